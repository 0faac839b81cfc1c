import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from tests.unit.vehicle_agent.autonomy.drives import driven
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.perception import Perception

NIGEL = load_car("nigel")
OBSTACLES = load_map("parking_school_obstacles")
MIDDLE = Pose2(-0.1, -0.35, 0.0)


def replayed(messages, city_map=OBSTACLES, begun=MIDDLE):
    """Return what the car knows after these messages."""
    perception = Perception(NIGEL, grid_of_city(city_map), 1)
    perception.begin(begun)
    return take(perception, messages)


def take(perception, messages):
    for message in messages:
        if isinstance(message, LidarScan):
            perception.scan(message)
        else:
            perception.sensors(message)
    return perception


def test_present_pose_is_known_while_the_car_drives():
    drive = driven("parking_school_obstacles", MIDDLE)
    perception, off = replayed([]), []
    for message in drive.messages:
        here = take(perception, [message]).now()
        if here is not None:
            off.append(drive.truth(here.t_ns).inverse() @ here.pose)
            assert here.t_ns == message.t_ns or isinstance(message, LidarScan)
    x, y, yaw = np.sqrt((np.array(off)[20:] ** 2).mean(axis=0))
    assert math.hypot(x, y) < 0.010
    assert yaw < 0.015


def test_box_that_the_map_has_not_becomes_an_obstacle_and_walls_do_not():
    drive = driven("parking_school_obstacles", MIDDLE)
    some = [m for m in drive.messages if m.t_ns < 4e9]
    assert replayed(some).obstacles.points().size == 0
    unmapped = replace(OBSTACLES, boxes=OBSTACLES.boxes[1:])
    points = replayed(some, unmapped).obstacles.points()
    box = OBSTACLES.boxes[0]
    assert len(points) > 5
    assert (np.abs(points[:, 0] - box.x_m) < 0.5 * box.length_m + 0.06).all()
    assert (np.abs(points[:, 1] - box.y_m) < 0.5 * box.width_m + 0.06).all()


def test_older_scan_is_not_used_again():
    drive = driven("parking_school_obstacles", MIDDLE)
    perception = replayed([m for m in drive.messages if m.t_ns < 4e9])
    here = perception.now()
    half_a_second_ago = drive.scans[24]
    assert perception.scan(half_a_second_ago) is None
    assert perception.now() == here


def test_nothing_is_known_before_a_sweep():
    drive = driven("parking_school_obstacles", MIDDLE)
    sensors = [m for m in drive.messages[:50] if not isinstance(m, LidarScan)]
    assert replayed(sensors).now() is None


@pytest.mark.parametrize("hours", [1, -1])
def test_clock_that_jumps_costs_one_sweep(hours):
    drive = driven("parking_school_obstacles", MIDDLE)
    shift_ns = hours * 3600 * 10**9
    before = [m for m in drive.messages if m.t_ns < 4e9]
    after = [m for m in drive.messages if 4e9 <= m.t_ns < 5e9]
    perception = replayed(before)
    here = take(perception, [replace(after[0], t_ns=after[0].t_ns + shift_ns)]).now()
    assert perception.clock_jump_s == pytest.approx(3600.0 * hours, abs=0.2)
    assert here is None or isinstance(after[0], LidarScan)
    take(perception, [replace(m, t_ns=m.t_ns + shift_ns) for m in after[1:]])
    here = perception.now()
    error = drive.truth(here.t_ns - shift_ns).inverse() @ here.pose
    assert here.is_known
    assert math.hypot(error.x, error.y) < 0.03


def test_scanner_that_looks_backward_is_noticed_at_the_first_sweep():
    drive = driven("parking_school_obstacles", MIDDLE)
    first = drive.scans[0]
    assert replayed([first]).mounting_problem == ""
    turned = replace(first, bearing_first_rad=first.bearing_first_rad + math.pi)
    assert "looks backward" in replayed([turned]).mounting_problem
    assert replayed([turned], begun=None).mounting_problem == ""
    assert replayed([first], begun=Pose2(0.3, 0.3, 2.0)).mounting_problem == ""


@pytest.mark.parametrize(
    ("name", "has_alternative"), [("parking_school", True), ("parking_school_obstacles", False)]
)
def test_lifted_car_knows_its_place_unless_the_scans_fit_two(name, has_alternative):
    here, there, stood = Pose2(0.0, -0.2, 1.4), Pose2(-0.5, -0.1, 0.1), ((1.0, 0.0, 0.0),)
    before, after = (driven(name, pose, stood).messages for pose in (here, there))
    perception = replayed(before, load_map(name), here)
    assert perception.now().is_known
    take(perception, [replace(m, t_ns=m.t_ns + 10**9) for m in after])
    assert (perception.localised.alternative is not None) is has_alternative
    assert perception.now().is_known is not has_alternative
    if not has_alternative:
        error = there.inverse() @ perception.now().pose
        assert math.hypot(error.x, error.y) < 0.02


@pytest.mark.parametrize(("source", "speed"), [("eye", 0.2), ("simulated", 0.0)])
def test_of_a_state_report_only_what_the_eye_saw_counts(source, speed):
    drive = driven("parking_school_obstacles", MIDDLE)
    perception = replayed(drive.scans[:1])
    t_ns = drive.scans[0].t_ns + 50_000_000
    state = VehicleState(
        vehicle="n1", t_ns=t_ns, seq=1, x_m=9.0, y_m=9.0, yaw_rad=0.0, speed_mps=0.2,
        yaw_rate_radps=0.0, steering_rad=0.1, throttle=0.0, source=source,
    )  # fmt: skip
    perception.state(state)
    assert perception.now().speed_mps == pytest.approx(speed, abs=0.01)
    assert perception.steering_rad == (0.1 if speed else 0.0)
    assert math.hypot(*(MIDDLE.inverse() @ perception.now().pose)[:2]) < 0.1
