import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from scm.geometry import Pose2
from vehicle_agent.autonomy.control import CONTROLLERS, Command, Tracker
from vehicle_agent.autonomy.plan import CarLimits, Path, timed
from vehicle_agent.autonomy.response import STEERINGS, THROTTLES, Response

CAR = CarLimits(
    wheelbase_m=0.1415, steering_rad=0.5236, steering_rate_radps=0.42, rear_m=-0.07, front_m=0.23,
    right_m=-0.0875, left_m=0.0875,
)  # fmt: skip
TOP_MPS = 0.26
STEP_NS = 20_000_000


def response(delay_s=0.0):
    return Response(TOP_MPS * THROTTLES, CAR.steering_rad * STEERINGS, delay_s, 0.0, delay_s)


def way(*pieces):
    """Return the trajectory of pieces of (length [m], curvature [1/m], gear)."""
    pose = Pose2(0.0, 0.0, 0.0)
    poses, gears, curvatures = [pose], [pieces[0][2]], [pieces[0][1]]
    for length, curvature, gear in pieces:
        for _ in range(round(length / 0.02)):
            turn = 0.02 * gear * curvature
            pose = pose @ Pose2(0.02 * gear, 0.01 * gear * turn, turn)
            poses.append(pose)
            gears.append(gear)
            curvatures.append(curvature)
    return timed(Path(np.array(poses), np.array(gears, float), np.array(curvatures, float)), CAR)


class Car:
    """A kinematic bicycle whose servo has a rate, and whose commands act late."""

    def __init__(self, pose, delay_s=0.0, trim_rad=0.0):
        self.pose, self.wheel, self.speed = pose, 0.0, 0.0
        self.trim, self.yaw_rate = trim_rad, 0.0
        self._late = deque([(0.0, 0.0)] * round(delay_s / 0.02))

    def step(self, command):
        self._late.append((command.throttle, command.steering))
        throttle, steering = self._late.popleft()
        self.speed = TOP_MPS * throttle
        turn = CAR.steering_rad * steering - self.wheel
        self.wheel += max(-0.42 * 0.02, min(0.42 * 0.02, turn))
        chord = 0.02 * self.speed
        yaw = chord * math.tan(self.wheel + self.trim) / CAR.wheelbase_m
        self.yaw_rate = yaw / 0.02
        self.pose = self.pose @ Pose2(chord, 0.5 * chord * yaw, yaw)


def follow(trajectory, car, controller="lqr", delay_s=0.0, lasts_s=30.0):
    """Drive until the end; return each step's pose, wheel angle and command."""
    tracker, rows = Tracker(CAR, response(delay_s), controller), []
    tracker.follow(trajectory)
    for step in range(round(lasts_s * 50)):
        command = tracker.command(step * STEP_NS, car.pose, car.speed, car.wheel)
        car.step(command)
        rows.append((*car.pose, car.wheel, command.throttle, command.steering))
        if tracker.is_done:
            break
    assert tracker.is_done
    for _ in range(50):  # what is on its way still acts
        car.step(Command(0.0, 0.0))
    return np.array([*rows, (*car.pose, car.wheel, 0.0, 0.0)])


def nearest(trajectory, rows):
    """Return which point of the way is nearest to each pose."""
    off = rows[:, None, :2] - trajectory.poses[None, :, :2]
    return np.linalg.norm(off, axis=2).argmin(axis=1)


def beside(trajectory, rows):
    """Return how far each pose is to the side of the nearest point of the way [m]."""
    x, y, yaw = trajectory.poses[nearest(trajectory, rows)].T
    return np.abs(np.cos(yaw) * (rows[:, 1] - y) - np.sin(yaw) * (rows[:, 0] - x))


def on_last_quarter(trajectory, rows):
    """Return the rows whose poses lie there."""
    return rows[nearest(trajectory, rows) > 0.75 * len(trajectory.poses)]


@pytest.mark.parametrize("gear", [1, -1])
@pytest.mark.parametrize("curvature", [0.0, 2.0])
@pytest.mark.parametrize("controller", [name for name in CONTROLLERS if name != "paper"])
def test_each_controller_brings_the_car_back(controller, curvature, gear):
    trajectory = way((1.6, curvature, gear))
    car = Car(Pose2(0.0, 0.04, 0.1))
    rows = follow(trajectory, car, controller)
    assert beside(trajectory, on_last_quarter(trajectory, rows)).max() < 0.005
    end = Pose2(*trajectory.poses[-1])
    assert abs(math.remainder(car.pose.yaw - end.yaw, math.tau)) < 0.02


def test_car_stops_at_the_end_of_its_way():
    car = Car(Pose2(0.0, 0.0, 0.0))
    rows = follow(way((0.6, 0.0, 1)), car)
    assert car.pose.x == pytest.approx(0.6, abs=0.006)
    assert rows[-1, 4] == 0.0
    assert rows[:, 4].max() * TOP_MPS < 1.25 * CAR.speed_mps


def test_wheels_turn_at_rest_at_a_cusp():
    trajectory = way((0.4, 3.0, 1), (0.4, -3.0, -1))
    car = Car(Pose2(0.0, 0.0, 0.0))
    rows = follow(trajectory, car)
    stands = np.abs(rows[:, 4]) < 1e-9
    turned = np.abs(np.diff(rows[:, 3]))
    cusp = np.flatnonzero(rows[:, 4] < 0.0)[0]
    at_cusp = stands[1:] & (np.arange(1, len(rows)) < cusp) & (np.arange(1, len(rows)) > 50)
    assert turned[at_cusp].sum() > 0.6  # of 2 atan(3 * wheelbase) = 0.80
    assert beside(trajectory, rows).max() < 0.01


def test_car_whose_commands_act_late_stops_at_the_end_if_that_is_known():
    trajectory, past = way((0.5, 0.0, 1), (1.0, 2.0, 1)), []
    for known in (0.3, 0.0):
        car = Car(Pose2(0.0, 0.0, 0.0), delay_s=0.3)
        follow(trajectory, car, delay_s=known)
        past.append(Pose2(*trajectory.poses[-1]).inverse().apply(*car.pose[:2])[0])
    foreseen, not_foreseen = past
    assert -0.005 < foreseen < 0.001
    assert abs(not_foreseen) > 0.004


@pytest.mark.parametrize(("delay_s", "swings_mps"), [(0.0, 0.012), (0.26, 0.004)])
def test_speed_that_falls_short_is_made_up_for_and_does_not_swing(delay_s, swings_mps):
    tracker, car = Tracker(CAR, response(delay_s)), Car(Pose2(0.0, 0.0, 0.0), delay_s)
    tracker.follow(way((3.0, 0.0, 1)))
    rng, speeds = np.random.default_rng(1), []
    for step in range(600):
        measured = car.speed + 0.01 * rng.standard_normal()
        command = tracker.command(step * STEP_NS, car.pose, measured, car.wheel)
        car.step(command._replace(throttle=0.8 * command.throttle))
        speeds.append(car.speed)
    assert np.mean(speeds[-200:]) == pytest.approx(CAR.speed_mps, abs=0.01)
    assert np.std(speeds[-200:]) < swings_mps


def test_car_without_a_way_stands():
    tracker = Tracker(CAR, response())
    command = tracker.command(0, Pose2(0.0, 0.0, 0.0), 0.1, 0.2)
    assert command.throttle == 0.0
    assert command.steering == pytest.approx(0.382, abs=0.01)
    tracker.follow(way((1.0, 0.0, 1)))
    poses, when_s = tracker.ahead(1.0)
    assert len(poses) == len(when_s) > 2
    assert when_s[-1] >= 1.0 > when_s[-2]
    tracker.stop()
    assert tracker.is_done
    assert len(tracker.ahead(1.0)[0]) == 0
    assert tracker.command(STEP_NS, Pose2(0.0, 0.0, 0.0), 0.1, 0.0).throttle == 0.0


def test_published_controller_follows_the_way_without_feedback():
    tracker = Tracker(CAR, response(), "paper")
    tracker.follow(way((1.0, 0.0, 1)))
    beside = Pose2(0.3, 0.05, 0.1)
    command = tracker.command(0, beside, 0.1, 0.0)
    assert command.steering == pytest.approx(0.0, abs=1e-6)
    assert command.throttle == pytest.approx(0.2 / 0.26, abs=0.01)


def test_published_controller_commands_five_times_a_second_and_stops_at_once():
    tracker = Tracker(CAR, response(), "paper")
    tracker.follow(way((0.3, 0.6, 1)))
    poses = [Pose2(*pose) for pose in tracker.ahead(10.0)[0]]
    sent = [tracker.command(k * STEP_NS, poses[0 if k < 1 else 5], 0.2, 0.0) for k in range(11)]
    assert len(set(sent)) == 2
    assert sent[9] == sent[0] != sent[10]
    tracker.stop()
    assert tracker.command(11 * STEP_NS, poses[5], 0.2, 0.0).throttle == 0.0


def test_published_controller_commands_the_angle_of_the_way_over_its_constant():
    weak = replace(response(), angles_rad=0.8 * response().angles_rad)
    tracker = Tracker(CAR, weak, "paper")
    tracker.follow(way((2.0, 2.0, 1)))
    on = Pose2(*tracker.ahead(3.0)[0][-1])
    for step in range(100):  # whatever the wheels do
        command = tracker.command(step * STEP_NS, on, 0.2, -0.2, yaw_rate_radps=0.5)
    assert command.steering == pytest.approx(math.atan(2.0 * CAR.wheelbase_m) / 0.5236, abs=0.005)
    assert command.throttle == pytest.approx(0.2 / 0.26, abs=0.01)


@pytest.mark.parametrize("gear", [1, -1])
def test_trim_of_the_wheels_is_learned_from_the_curvature_driven(gear):
    """Each stretch begins where the car is, so its place beside the way never shows the trim."""
    tracker, car = Tracker(CAR, response()), Car(Pose2(0.0, 0.0, 0.0), trim_rad=0.06)
    for step in range(400):
        if step % 7 == 0:
            stretch = way((1.0, 0.0, gear))
            ends = [tuple(car.pose @ Pose2(*pose)) for pose in stretch.poses]
            tracker.follow(replace(stretch, poses=np.array(ends)))
        wheel = car.wheel + car.trim
        command = tracker.command(step * STEP_NS, car.pose, car.speed, wheel, car.yaw_rate)
        car.step(command)
    assert command.steering * CAR.steering_rad == pytest.approx(-0.06, abs=0.01)
