"""Windows driven from the measured motion, and what a faulty camera makes of a car's place."""

import numpy as np
import pytest

from scm.replay.camera import Camera
from scm.replay.drive import STEP_S
from scm.replay.windows import Side, Windows
from tests.unit.mismatch.made_drive import big_nigel, driven, healthy_model

FAULTS = {
    "measure.pose_scale": 1.04, "measure.camera_tilt_x_per_m": 0.03,
    "measure.camera_tilt_y_per_m": -0.02, "measure.pose_point_x_m": 0.05,
    "measure.pose_point_y_m": -0.01, "measure.pose_heading_rad": 0.03,
}  # fmt: skip
CLOCKS = {"measure.pose_delay_s": 0.1, "measure.clock_rate": 0.004, "clock.pose_s": 0.002}


@pytest.fixture(scope="module")
def drive():
    return healthy_model().drives[0]


def run(drive, *sides, start=500, steps=100):
    starts = np.full((len(sides), 1), start)
    return Windows(drive, big_nigel()).run(sides, starts, steps)


def plain(drive, numbers=(), **more):
    return Side(dict(numbers), Camera(drive, dict(numbers)), **more)


def test_what_a_camera_sees_is_put_back_where_it_is(drive):
    camera = Camera(drive, FAULTS)
    place = tuple(np.array([v]) for v in (0.7, -0.4, 1.1))
    assert np.allclose(camera.truly(*camera.seen(*place)), place, atol=1e-12)


def test_a_camera_without_faults_sees_the_rear_axle(drive):
    place = tuple(np.array([v]) for v in (0.7, -0.4, 1.1))
    assert np.allclose(Camera(drive, {}).seen(*place), place)


def test_stamps_of_a_late_and_drifting_camera_go_to_and_fro(drive):
    camera = Camera(drive, CLOCKS)
    t = drive.edges[:3] + 5.0
    assert np.allclose(camera.true_times(camera.stamp(t)), t)
    assert camera.stamp(t)[0] - t[0] == pytest.approx(0.102 + 0.004 * (t[0] - drive.edges[0]))


def test_the_measured_motion_has_the_speed_that_the_path_has(drive):
    t = drive.edges[300:1500:100]
    moved = Camera(drive, {}).motion(t)
    ends = [Camera(drive, {}).motion(t + h) for h in (-0.05, 0.05)]
    path = np.hypot(ends[1].x - ends[0].x, ends[1].y - ends[0].y) / 0.1
    assert np.allclose(np.hypot(moved.speed, moved.lateral_speed), path, atol=0.01)


def test_a_window_starts_in_the_measured_motion(drive):
    side = plain(drive)
    runs, moved = run(drive, side), side.camera.motion(drive.edges[500:501])
    assert runs["x"][0, 0, 0] == pytest.approx(moved.x[0])
    assert runs["speed"][0, 0, 0] == pytest.approx(moved.speed[0], abs=1e-6)
    assert runs["yaw_rate"][0, 0, 0] == pytest.approx(moved.yaw_rate[0], abs=1e-6)


def test_the_true_car_stays_with_the_recording(drive):
    side = plain(drive)
    runs, moved = run(drive, side), side.camera.motion(drive.edges[600:601])
    assert np.hypot(runs["x"][-1] - moved.x, runs["y"][-1] - moved.y).max() < 0.01


def test_a_later_window_is_of_an_older_car(drive):
    sagging = plain(drive, {"drive.sag_per_min": 0.5})
    speeds = []
    for start in (300, 1500):
        runs = run(drive, sagging, plain(drive), start=start, steps=60)
        speeds.append(runs["speed"][-1, 0, 0] / runs["speed"][-1, 1, 0])
    assert speeds[0] - speeds[1] == pytest.approx(0.1, abs=0.03)


def test_a_motor_that_faded_on_the_way_is_faded_in_the_window(drive):
    faded, cold = {"drive.fade": 0.8, "drive.fade_time_s": 5.0}, {"drive.fade": 0.0}
    runs = run(drive, plain(drive, faded), plain(drive, cold), start=1500, steps=60)
    assert runs["speed"][-1, 0, 0] < 0.9 * runs["speed"][-1, 1, 0]


def test_a_push_acts_along_the_body_whatever_its_heading(drive):
    starts = np.tile(np.arange(200, 1800, 200), (2, 1))
    sides = [plain(drive), plain(drive, like=0, push=(1.0, 0.0))]
    runs = Windows(drive, big_nigel()).run(sides, starts, 40)
    gained = runs["speed"][-1, 1] - runs["speed"][-1, 0]
    assert np.ptp(runs["yaw"][0, 0]) > 1.0
    assert gained.min() > 0.8 * gained.max() > 0.0


def test_turned_wheels_turn_the_car(drive):
    runs = run(drive, plain(drive), plain(drive, like=0, push=(0.0, 0.05)), steps=40)
    assert runs["yaw_rate"][-1, 1, 0] > runs["yaw_rate"][-1, 0, 0] + 0.02


def test_windows_side_by_side_do_what_each_does_alone(drive):
    side = plain(drive)
    both = Windows(drive, big_nigel()).run([side], np.array([[400, 900]]), 50)
    for k, start in enumerate((400, 900)):
        alone = run(drive, side, start=start, steps=50)
        assert both["x"][-1, 0, k] == pytest.approx(alone["x"][-1, 0, 0], abs=2e-3)


def test_late_commands_reach_the_car_late():
    drive = driven()
    late = {"drive.delay_s": 0.3, "steering.delay_s": 0.3}
    leap = int(np.argmax(np.abs(np.diff(drive.steering.values)) > 0.5)) + 1
    start = int((drive.steering.t[leap] - drive.edges[0]) / STEP_S) - 10
    runs = run(drive, plain(drive), plain(drive, late), start=start, steps=30)
    apart = np.abs(runs["steer_angle"][:, 0, 0] - runs["steer_angle"][:, 1, 0])
    assert apart[5] < 1e-3
    assert apart[-1] > 0.03


def test_windows_of_a_car_that_remembers_its_commands_do_what_each_does_alone():
    drive, late = driven(), {"drive.delay_s": 0.3, "steering.delay_s": 0.3}
    late_car = big_nigel().with_terms(["drive_delay", "steer_delay"], late)
    starts = np.array([[400, 650, 900]])
    remembered = Windows(drive, late_car).run([plain(drive)], starts, 50)
    commanded = Windows(drive, big_nigel()).run([plain(drive, late)], starts, 50)
    for name in ("speed", "steer_angle"):
        assert remembered[name] == pytest.approx(commanded[name], abs=4e-3)
