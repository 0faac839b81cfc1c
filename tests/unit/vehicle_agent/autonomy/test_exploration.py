import numpy as np
import pytest
from msgspec.structs import replace

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.vehicles.car import load_car
from scm.world.part import WorldPart
from tests.unit.vehicle_agent.autonomy.drives import driven
from vehicle_agent.autonomy.exploration import Exploration, frontiers, next_view
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, UNKNOWN, grid_of_cells
from vehicle_agent.autonomy.map_part import MapPart
from vehicle_agent.autonomy.navigation import Navigator

NIGEL = load_car("nigel")
HERE = Pose2(0.5, 1.0, 0.0)


def half_seen():
    """Return a room of 2 x 2 m whose right half is not known yet."""
    cells = np.full((100, 100), FREE, np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    cells[:, 60:] = UNKNOWN
    return grid_of_cells(cells, 0.02, 0.0, 0.0)


def test_frontier_lies_between_free_and_unknown():
    (middle,) = frontiers(half_seen())
    assert middle == pytest.approx([1.19, 1.0], abs=0.02)


def test_next_view_is_near_the_frontier_on_free_floor():
    path, middle = next_view(half_seen(), Navigator(NIGEL), HERE, [])
    x, y, _ = path.poses[-1]
    assert np.hypot(x - middle[0], y - middle[1]) < 0.6
    assert x < 1.0


def test_frontier_looked_at_before_is_left():
    grid = half_seen()
    assert next_view(grid, Navigator(NIGEL), HERE, frontiers(grid)) is None


def test_nothing_is_left_in_a_room_that_is_known():
    grid = grid_of_cells(np.full((100, 100), FREE, np.int8), 0.02, 0.0, 0.0)
    assert next_view(grid, Navigator(NIGEL), HERE, []) is None


def test_car_maps_a_room_that_it_does_not_know():
    start = Pose2(-0.7, 0.3, 0.0)
    world, part = WorldPart(load_map("parking_school_obstacles"), 1, ()), MapPart("map-n1", "n1")
    with Lockstep([world, part]) as city:
        contacts = city.subscribe(Subscription(Contact, {"vehicle": "n1"}))
        maps = city.subscribe(Subscription(OccupancyMap, {"vehicle": "n1"}))
        reports = city.subscribe(Subscription(AutonomyStatus, {"vehicle": "n1"}))
        car = world.world.host("n1", "nigel", start, 0)
        city.run_until(lambda: part.is_over, 90.0, "the room is mapped")
        city.run_for(2.0)
        here = part.exploration.here()
        rooms = [incoming.message for incoming in maps.drain()]
        statuses = [incoming.message for incoming in reports.drain()]
    assert contacts.drain() == []
    off = (start.inverse() @ car.pose).inverse() @ here.pose
    assert np.hypot(off.x, off.y) < 0.03
    grid = part.exploration.mapper.grid()
    free_m2 = (grid.cells == FREE).sum() * grid.cell_m**2
    assert 2.0 < free_m2 < 2.6  # of 2.15 x 1.25 m less two boxes, partly hidden
    last = rooms[-1]
    cells = np.frombuffer(last.cells, np.int8).reshape(last.rows, last.columns)
    assert (cells == part.exploration.grid.cells).all()
    assert last.path == ()
    ways = [room for room in rooms if room.path]
    assert ways
    assert all(room.state == "map" for room in ways)
    assert [statuses[0].state, statuses[-1].state] == ["map", "idle"]
    assert statuses[-1].reason.startswith("mapped all that can be reached")
    assert {(one.x_m, one.goal_x_m) for one in statuses} == {(None, None)}


def test_room_is_not_mapped_by_a_scanner_that_looks_backward():
    drive, exploration = driven("parking_school", Pose2(-0.1, -0.35, 0.0)), Exploration(NIGEL)
    for message in [m for m in drive.messages if m.t_ns < 3e9]:
        if isinstance(message, LidarScan):
            turned = replace(message, bearing_first_rad=np.pi)
            exploration.scan(turned, message.t_ns)
            exploration.check_scans(message.t_ns)
        else:
            exploration.sensors(message)
    assert exploration.report.state == "failed"
    assert "the other way than its wheels" in exploration.report.reason


@pytest.mark.parametrize("drives", [True, False])
def test_car_without_scans_is_named_within_two_seconds(drives):
    reports = []
    part = MapPart("map-n9", "n9", drives=drives, on_report=reports.append)
    with Lockstep([part]) as city:
        city.run_for(1.9)
    assert reports[-1].state == "recover"
    assert reports[-1].reason.startswith("no LIDAR scan for 1 s")
    assert not part.is_over
