import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.errors import CarError
from scm.geometry import Pose2
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.autonomy.drives import driven, way_m
from tests.unit.vehicle_agent.autonomy.rooms import BEAMS, ROOM, later, sweep_at
from vehicle_agent.autonomy.odometry import OdometryFilter, Seen, mount_of
from vehicle_agent.autonomy.sweep import Twist

NIGEL = load_car("nigel")
MIDDLE = Pose2(0.0, -0.35, 0.0)


def replayed(messages):
    """Return the filter after these messages."""
    odometry = OdometryFilter(NIGEL)
    for message in messages:
        if isinstance(message, LidarScan):
            odometry.scan(message)
        else:
            odometry.sensors(message)
    return odometry


def drift(drive, messages=None):
    """Return how far the pose at the end is wrong [m, rad]."""
    found = replayed(drive.messages if messages is None else messages).now()
    moved = drive.truth(drive.messages[0].t_ns).inverse() @ drive.truth(found.t_ns)
    off = moved.inverse() @ found.pose
    return math.hypot(off.x, off.y), abs(off.yaw)


def standing(count, yaw_rate=0.0):
    """Return measurements of a car whose wheels stand."""
    return [
        VehicleSensors(
            vehicle="n1", t_ns=20_000_000 * k, encoder_left=7, encoder_right=9,
            accel_mps2=(0.0, 0.0, 9.81), gyro_radps=(0.0, 0.0, yaw_rate),
        )
        for k in range(count)
    ]  # fmt: skip


def test_drive_in_a_room_drifts_by_less_than_2_percent():
    drive = driven("parking_school", MIDDLE)
    way, turn = drift(drive)
    assert way_m(drive) > 2.0
    assert way < 0.02 * way_m(drive)
    assert turn < 0.03


def seen_by_the_eye(drive, late_s=0.1):
    """Return a drive's messages with the Eye's view of the motion in place of its sensors."""

    def seen(t_ns):
        then, now = (drive.truth(t_ns - round(1e9 * s)) for s in (late_s + 0.05, late_s))
        moved = then.inverse() @ now
        return Seen(t_ns, moved.x / 0.05, moved.yaw / 0.05)

    return [m if isinstance(m, LidarScan) else seen(m.t_ns) for m in drive.messages]


def test_car_with_but_a_scanner_has_its_motion_from_the_eye():
    drive = driven("parking_school", MIDDLE)
    way, turn = drift(drive, seen_by_the_eye(drive))
    assert way < 0.04 * way_m(drive)
    assert turn < 0.05


def measured(t_s, way_m, yaw_rate):
    counts = way_m / (math.tau * NIGEL.value("wheel.radius_m"))
    counts = round(counts * NIGEL.value("encoder.counts_per_revolution"))
    return VehicleSensors(
        vehicle="n1", t_ns=round(1e9 * t_s), encoder_left=counts, encoder_right=counts,
        accel_mps2=(0.0, 0.0, 9.81), gyro_radps=(0.0, 0.0, yaw_rate),
    )  # fmt: skip


def scanned(sweep):
    return LidarScan(
        vehicle="n1", t_ns=sweep.t_ns, beams=BEAMS, range_min_m=0.05, range_max_m=12.0,
        payload=sweep.ranges.astype("<f4").tobytes(), sweep_ns=round(1e9 / 7.0),
    )  # fmt: skip


def test_scanner_whose_beams_look_one_after_another_is_as_good():
    twist, start, mount = Twist(0.25, 0.0, 0.9), Pose2(0.1, -0.25, 0.0), mount_of(NIGEL)
    of_scanner = Twist(0.25, 0.9 * mount.x, 0.9)
    odometry = OdometryFilter(NIGEL)
    for tick in range(150):
        t_s = 0.02 * tick
        odometry.sensors(measured(t_s, 0.25 * t_s, 0.9))
        if tick % 7 == 0:
            at = start @ later(twist, t_s) @ mount
            sweep = sweep_at(ROOM, at, of_scanner, t_ns=round(1e9 * t_s), sweep_s=1.0 / 7.0)
            odometry.scan(scanned(sweep))
    found = odometry.now()
    off = later(twist, 1e-9 * found.t_ns).inverse() @ found.pose
    assert math.hypot(off.x, off.y) < 0.01
    assert abs(off.yaw) < 0.01


def test_without_a_scanner_the_wheels_and_gyro_carry_on():
    drive = driven("parking_school", MIDDLE)
    sensors = [m for m in drive.messages if isinstance(m, VehicleSensors)]
    way, _ = drift(drive, sensors)
    assert way < 0.1 * way_m(drive)


def test_gyro_bias_is_found_at_rest():
    found = replayed(standing(100, yaw_rate=0.03)).now()
    assert abs(found.pose.yaw) < 0.02
    assert found.twist.yaw_rate_radps == 0.0


def test_standing_car_does_not_drift():
    drive = driven("parking_school", MIDDLE, ((3.0, 0.0, 0.0),))
    way, turn = drift(drive)
    assert way < 0.005
    assert turn < 0.005


def test_wheels_that_spin_at_a_wall_are_noticed():
    at_wall = Pose2(0.94, 0.3, 0.0)
    drive = driven("parking_school", at_wall, ((1.0, 0.0, 0.0), (4.0, 1.0, 0.0)))
    counts = [m.encoder_left for m in drive.messages if isinstance(m, VehicleSensors)]
    turned_m = (counts[-1] - counts[0]) / NIGEL.value("encoder.counts_per_revolution")
    turned_m *= math.tau * NIGEL.value("wheel.radius_m")
    assert turned_m > 0.3
    assert way_m(drive) < 0.05
    assert drift(drive)[0] < 0.25 * turned_m
    assert not replayed(drive.messages).is_contrary


@pytest.mark.parametrize("by_the_eye", [False, True])
def test_scanner_that_looks_backward_contradicts_the_wheels_or_the_eye(by_the_eye):
    drive = driven("parking_school", MIDDLE)
    messages = seen_by_the_eye(drive) if by_the_eye else drive.messages
    turned = [
        replace(m, bearing_first_rad=math.pi) if isinstance(m, LidarScan) else m
        for m in messages
        if m.t_ns < 3e9
    ]
    assert replayed(turned).is_contrary
    assert not replayed([m for m in turned if m.t_ns < 1e9]).is_contrary  # it stood
    assert not replayed(messages).is_contrary


def test_older_messages_are_ignored():
    drive = driven("parking_school", MIDDLE)
    some = drive.messages[:400]
    before = replayed(some)
    expected = before.now()
    for message in some[100:200]:
        if isinstance(message, LidarScan):
            assert before.scan(message) is None
        else:
            before.sensors(message)
    assert before.now().pose == expected.pose


def test_question_changes_nothing():
    drive = driven("parking_school", MIDDLE)
    queried, undisturbed = OdometryFilter(NIGEL), OdometryFilter(NIGEL)
    for message in drive.messages[:400]:
        for odometry in (queried, undisturbed):
            if isinstance(message, LidarScan):
                odometry.scan(message)
            else:
                odometry.sensors(message)
        queried.now()
    assert queried.now().pose == undisturbed.now().pose


def test_present_pose_is_ahead_of_the_last_sweep():
    drive = driven("parking_school", MIDDLE)
    until = next(i for i, m in enumerate(drive.messages) if m.t_ns > 4e9)
    odometry = replayed(drive.messages[:until])
    now, swept = odometry.now(), odometry.at_sweep
    assert now.t_ns > swept.t_ns
    true = drive.truth(swept.t_ns).inverse() @ drive.truth(now.t_ns)
    moved = swept.pose.inverse() @ now.pose
    assert true.x > 0.002
    np.testing.assert_allclose(moved, true, atol=0.003)


def test_car_without_a_scanner_is_refused():
    with pytest.raises(CarError, match="expected the place of a scanner"):
        OdometryFilter(load_car("dart"))
