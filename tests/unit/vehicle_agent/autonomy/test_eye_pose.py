"""The Eye as a second witness: its poses beside what the scanner sees."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.lidar_scan import LidarScan
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.autonomy.drives import driven
from vehicle_agent.autonomy.eye_pose import EyePoses
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.odometry import Odometry
from vehicle_agent.autonomy.perception import Perception
from vehicle_agent.autonomy.sweep import Twist

NIGEL = load_car("nigel")
ROOMS = {name: load_map(name) for name in ("parking_school", "parking_school_obstacles")}
MIDDLE, CORNER = Pose2(-0.1, -0.35, 0.0), Pose2(-0.7, 0.3, 0.0)
MIRRORED = Pose2(0.2, 0.0, math.pi) @ CORNER  # where the empty room looks the same
STOOD = ((4.0, 0.0, 0.0),)
MS = 10**6  # ns
NONE = Pose2(0.0, 0.0, 0.0)
STD = (0.003, 0.003, 0.004, 0.01, 0.01, 0.05)
WIDE = np.diag((0.06**2, *(0.003**2,) * 5)).tolist()
NEGATIVE = np.diag((-1.0, *(0.003**2,) * 5)).tolist()


def track(pose, t_ns, **changed):
    covariance = tuple(map(tuple, np.diag(np.square(STD)).tolist()))
    one = EyeTrack(
        vehicle="n1", tag_id=1, t_ns=t_ns, x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw, speed_mps=0.0,
        lateral_speed_mps=0.0, yaw_rate_radps=0.0, covariance=covariance, age_s=0.05, stale=False,
    )  # fmt: skip
    return replace(one, **changed)


def localised(drive, room, begun, tag=None, late_ms=100, lasts_s=100.0, **changed):
    """Return perception after a drive, and position errors after each sweep [m].

    Args:
        tag: From a time to where the Eye sees the car 20 times a second; None: it does not.
        late_ms: After which its tracks arrive.
        changed: Fields of its tracks.
    """
    perception = Perception(NIGEL, grid_of_city(ROOMS[room]), 1)
    perception.begin(begun)
    last_ns = min(drive.messages[-1].t_ns, lasts_s * 1e9)
    times = [] if tag is None else range(0, int(last_ns), 50 * MS)
    came = [(t + late_ms * MS, track(tag(t), t, **changed)) for t in times]
    came += [(one.t_ns, one) for one in drive.messages if one.t_ns < last_ns]
    off = []
    for _, message in sorted(came, key=lambda item: item[0]):
        if isinstance(message, EyeTrack):
            perception.eye.receive(message)
        elif not isinstance(message, LidarScan):
            perception.sensors(message)
        elif (found := perception.scan(message)) is not None:
            true = drive.truth(message.t_ns)
            off.append(math.hypot(found.pose.x - true.x, found.pose.y - true.y))
    return perception, np.array(off)


def beside(drive, x=0.0, y=0.0, yaw=0.0):
    """Return where a tag that is off by a pose in the map has the car."""
    return lambda t_ns: Pose2(*np.add(drive.truth(t_ns), (x, y, yaw)).tolist())


def test_pose_is_moved_on_from_its_time_to_that_of_the_sweep():
    eye, twist = EyePoses(), Twist(0.2, 0.0, 0.0)
    for t_ms, x in ((0, 5.0), (140, 5.1)):
        now = Odometry(t_ms * MS, Pose2(x, 0.0, 0.0), twist, np.zeros((3, 3)))
        if t_ms:
            eye.receive(track(Pose2(1.0, 2.0, 0.5 * math.pi), 70 * MS))
            eye.receive(track(Pose2(9.0, 9.0, 0.0), 150 * MS))  # after the sweep: not yet
        seen = eye.at_sweep(now)
    np.testing.assert_allclose(seen.pose, (1.0, 2.05, 0.5 * math.pi), atol=1e-9)
    assert np.sqrt(seen.covariance[0, 0]) == pytest.approx(0.0301, abs=1e-4)
    later = Odometry(280 * MS, Pose2(5.2, 0.0, 0.0), twist, np.zeros((3, 3)))
    assert eye.at_sweep(later).pose.x == pytest.approx(9.0 + 0.1 * 130 / 140)
    assert eye.at_sweep(later) is None


def test_pose_before_the_first_sweep_is_moved_on_by_the_speed():
    eye = EyePoses()
    eye.receive(track(Pose2(1.0, 2.0, 0.0), 0))
    now = Odometry(100 * MS, NONE, Twist(0.2, 0.0, 0.0), np.zeros((3, 3)))
    assert eye.at_sweep(now).pose.x == pytest.approx(1.02)


@pytest.mark.parametrize(
    "changed",
    [
        {"stale": True}, {"age_s": 0.3}, {"age_s": math.nan}, {"flags": ("wrong_id",)},
        {"flags": ("bumped",)}, {"x_m": math.nan}, {"covariance": WIDE}, {"covariance": NEGATIVE},
        {"t_ns": -500 * MS}, {"t_ns": 3600 * 10**9},
    ],
)  # fmt: skip
def test_track_that_must_not_be_trusted_is_not_used(changed):
    now, good = Odometry(0, NONE, Twist(0.0, 0.0, 0.0), np.zeros((3, 3))), track(MIDDLE, 0)
    for one, is_used in (
        (replace(good, flags=("jumped",)), True),
        (replace(good, **changed), False),
    ):
        eye = EyePoses()
        eye.receive(one)
        assert (eye.at_sweep(now) is not None) == is_used


@pytest.mark.parametrize("late_ms", [0, 250])
def test_late_eye_leaves_the_error_of_a_drive_as_small(late_ms):
    drive = driven("parking_school_obstacles", MIDDLE)
    perception, off = localised(
        drive, "parking_school_obstacles", MIDDLE, drive.truth, late_ms, 8.0
    )
    assert np.sqrt((off[3:] ** 2).mean()) < 0.008
    assert perception.eye.problem == ""


def test_calibration_that_is_20_mm_off_pulls_the_car_by_less_than_2_mm():
    drive = driven("parking_school_obstacles", MIDDLE)
    poses = []
    for y in (-0.02, 0.02):
        perception, _ = localised(
            drive, "parking_school_obstacles", MIDDLE, beside(drive, y=y), lasts_s=5.0
        )
        poses.append(perception.localised.pose.y)
        assert perception.eye.problem == ""
    assert abs(poses[1] - poses[0]) < 0.004


def test_wrong_tag_does_not_pull_the_car_and_is_reported_after_a_second():
    drive = driven("parking_school_obstacles", MIDDLE)
    wrong = beside(drive, y=0.4, yaw=0.3)
    perception, off = localised(drive, "parking_school_obstacles", MIDDLE, wrong, lasts_s=0.9)
    assert perception.eye.problem == ""
    perception, off = localised(drive, "parking_school_obstacles", MIDDLE, wrong, lasts_s=4.0)
    assert off.max() < 0.03
    assert perception.eye.problem.startswith("the Eye sees the car 0.4")
    assert perception.eye.problem.endswith("the scans are believed")


def test_wrong_tag_does_not_keep_a_car_from_being_found_by_its_scans():
    drive = driven("parking_school_obstacles", CORNER, STOOD)
    wrong = beside(drive, x=0.5, y=-0.4)
    perception, off = localised(drive, "parking_school_obstacles", None, wrong, lasts_s=2.0)
    assert off[1:].max() < 0.03
    assert perception.now().is_known


def test_eye_says_which_of_two_places_that_look_the_same():
    drive = driven("parking_school", CORNER, STOOD)
    perception, _ = localised(drive, "parking_school", None, lasts_s=1.0)
    assert not perception.now().is_known
    for late_ms in (100, 400):  # before the first sweep is searched with, and after
        perception, off = localised(
            drive, "parking_school", None, drive.truth, late_ms, lasts_s=2.0
        )
        assert off[-1] < 0.03
        assert perception.now().is_known


def test_eye_puts_a_car_right_that_was_carried_to_where_the_room_looks_the_same():
    drive = driven("parking_school", CORNER, STOOD)
    perception, off = localised(drive, "parking_school", MIRRORED, drive.truth, lasts_s=3.0)
    assert (off[:5] > 1.0).all()
    assert off[-1] < 0.03
    assert perception.now().is_known
    assert perception.eye.problem == ""


def test_eye_finds_a_car_again_that_was_put_elsewhere_at_the_next_sweep():
    drive = driven("parking_school_obstacles", CORNER, STOOD)
    _, alone = localised(drive, "parking_school_obstacles", MIDDLE, lasts_s=1.0)
    assert alone[2] > 0.1
    _, off = localised(drive, "parking_school_obstacles", MIDDLE, drive.truth, lasts_s=1.0)
    assert off[2] < 0.03
