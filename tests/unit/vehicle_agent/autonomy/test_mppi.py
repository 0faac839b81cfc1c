import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.clock import NS_PER_S
from scm.errors import PathError, RunError
from scm.geometry import Pose2
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.autonomy.bends import START, floor, path_of
from vehicle_agent.autonomy.control import Command
from vehicle_agent.autonomy.moving import comes_near
from vehicle_agent.autonomy.mppi import PathIntegral, Settings
from vehicle_agent.autonomy.navigation import MPPI, Navigator, Stack
from vehicle_agent.autonomy.outline import room, scene_of
from vehicle_agent.autonomy.perception import Whereabouts
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.autonomy.response import response_of

NIGEL = load_car("nigel")
RESPONSE = response_of(NIGEL)
LIMITS = RESPONSE.limited(limits_of(NIGEL))
FEW = Settings(cars=63, rounds=3)
NOTHING = np.empty((0, 5))
BEND = 1.0 / 0.3


STRAIGHT = path_of((0.5, 0.0))


def planner(settings=FEW, car=NIGEL, sent=()):
    return PathIntegral(car, LIMITS, RESPONSE, sent, settings)


def at(trajectory, t):
    """Return pose, speed and steering at a time, between states linearly."""
    columns = [*trajectory.poses.T, trajectory.speeds_mps, trajectory.steering_rad]
    x, y, yaw, speed, steering = (float(np.interp(t, trajectory.times_s, one)) for one in columns)
    return Pose2(x, y, yaw), speed, steering


def driven(path, grid, lasts_s, every_s=0.2):
    """Return states (n, 5) of a car that is where each plan has it."""
    plans, state, rows = planner(), (START, 0.0, 0.0), []
    for number in range(round(lasts_s / every_s)):
        trajectory = plans.plan(grid, path, *state, NOTHING, number * every_s)
        state = at(trajectory, every_s)
        rows.append((*state[0], *state[1:]))
    return np.array(rows)


def test_box_in_the_straight_way_is_passed_without_touching():
    grid = floor((1.1, 0.84, 1.2, 1.0))
    states = driven(path_of((1.6, 0.0)), grid, 8.0)
    assert np.isfinite(room(scene_of(grid, LIMITS), states[:, :3], 0.005)).all()
    assert states[-1, 0] > 1.3
    assert states[:, 1].max() > 1.03


def test_car_stops_at_the_end_of_the_path():
    states = driven(STRAIGHT, floor(), 5.0)
    assert_allclose(states[-1, :3], STRAIGHT.poses[-1], atol=0.015)
    assert states[:, 0].max() < STRAIGHT.poses[-1, 0] + 0.01
    assert states[:, 3].max() == pytest.approx(LIMITS.speed_mps, rel=0.15)


def test_reverse_piece_is_driven_backward_to_its_end():
    path = path_of((-0.4, -BEND))
    states = driven(path, floor(), 6.0)
    assert states[:, 3].max() < 0.02
    assert_allclose(states[-1, :2], path.poses[-1, :2], atol=0.02)
    assert states[-1, 2] == pytest.approx(path.poses[-1, 2], abs=0.08)


def test_trajectory_goes_on_beyond_the_cusp_along_the_path():
    path = path_of((0.2, 0.0), (-0.3, BEND))
    trajectory = planner().plan(floor(), path, START, 0.0, 0.0, NOTHING, 0.0)
    assert trajectory.poses[:, 0].max() == pytest.approx(0.7, abs=0.02)
    assert_allclose(trajectory.poses[-1], path.poses[-1], atol=1e-9)
    assert trajectory.speeds_mps.min() < -0.1


def test_car_that_stands_turns_its_wheels_first():
    path = path_of((0.4, BEND))
    trajectory = planner().plan(floor(), path, START, 0.0, 0.0, NOTHING, 0.0)
    angle = math.atan(LIMITS.wheelbase_m * BEND)
    assert_allclose(trajectory.steering_rad[:2], (0.0, angle), atol=1e-6)
    assert trajectory.times_s[1] == pytest.approx(angle / LIMITS.steering_rate_radps)
    assert_array_equal(trajectory.poses[0], trajectory.poses[1])


def test_moving_obstacle_is_given_way():
    plans, way = planner(Settings(cars=127)), path_of((1.6, 0.0))
    for t in (0.0, 0.1, 0.2):
        crossing = np.array([[1.1, 1.65 - 0.17 * t, 0.0, -0.17, 0.1]])
        trajectory = plans.plan(floor(), way, START, 0.1, 0.0, crossing, t)
    within = trajectory.times_s <= 4.0
    poses, times = trajectory.poses[within], trajectory.times_s[within]
    assert not comes_near(poses, times, crossing, LIMITS)
    straight_on = np.tile(START, (len(times), 1))
    straight_on[:, 0] += LIMITS.speed_mps * times
    assert comes_near(straight_on, times, crossing, LIMITS)


def test_blocked_way_leads_into_what_blocks_it_so_that_the_car_is_stopped():
    grid = floor((0.9, 0.0, 1.0, 2.0))
    trajectory = planner().plan(grid, path_of((1.6, 0.0)), START, 0.0, 0.0, NOTHING, 0.0)
    rooms = room(scene_of(grid, LIMITS), trajectory.poses, 0.0)
    assert np.isinf(rooms).any()
    assert np.isfinite(rooms[trajectory.times_s < 0.5]).all()


def test_same_seed_gives_the_same_bits():
    path, grid = path_of((0.3, 0.0), (0.4, BEND)), floor()
    one, same, other = (
        planner(replace(FEW, seed=seed)).plan(grid, path, START, 0.1, 0.0, NOTHING, 0.0)
        for seed in (1, 1, 2)
    )
    assert_array_equal(one.poses, same.poses)
    assert_array_equal(one.times_s, same.times_s)
    assert not np.array_equal(one.poses[:20], other.poses[:20])


def test_commands_on_their_way_move_a_car_with_a_delay():
    late = NIGEL.with_terms(
        ["drive_deadband", "drive_delay"], {"drive.deadband": 0.0, "drive.delay_s": 0.3}
    )
    ways = []
    for throttle in (0.0, 0.7):
        sent = deque()
        plans = planner(car=late, sent=sent)
        for number in range(2):
            t = 0.5 * number
            trajectory = plans.plan(floor(), STRAIGHT, START, 0.15, 0.0, NOTHING, t)
            sent.extend(
                (round((t + 0.02 * k) * NS_PER_S), Command(throttle, 0.0), 0.0) for k in range(25)
            )
        ways.append(at(trajectory, 0.25)[0].x - START.x)
    assert ways[0] < 0.015
    assert ways[1] > 0.03


def test_navigator_of_the_stack_drives_by_rollouts_that_know_what_was_sent():
    navigator = Navigator(NIGEL, MPPI)
    here = Whereabouts(0, START, 0.0, 0.0, is_known=True)
    navigator.follow(STRAIGHT, floor(), here, 0.0)
    assert not navigator.is_blocked(floor())
    assert navigator.command(0, here, 0.0).throttle > 0.1
    assert [t_ns for t_ns, *_ in navigator._local._sent] == [0]


def test_unknown_local_planner_is_refused():
    with pytest.raises(RunError, match="expected 'band' or 'mppi', got 'teb'"):
        Navigator(NIGEL, Stack(local="teb"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cars": 0}, "cars: expected at least 4"),
        ({"temperature": math.nan}, "temperature: .* nan"),
    ],
)
def test_settings_that_cannot_be_are_refused(change, words):
    with pytest.raises(RunError, match=words):
        Settings(**change)


def test_pose_that_is_no_number_is_refused():
    with pytest.raises(PathError, match="expected a pose, speed and steering angle"):
        planner().plan(floor(), STRAIGHT, START, math.nan, 0.0, NOTHING, 0.0)
