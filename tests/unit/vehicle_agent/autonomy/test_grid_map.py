import math

import numpy as np
import pytest
from msgspec.structs import replace

from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.grid import OccupancyGrid
from scm.maps.load import load_map
from scm.records.city_map import Wall
from vehicle_agent.autonomy.grid_map import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    grid_of_cells,
    grid_of_city,
    grid_of_scan,
    value_at,
    with_points,
)  # fmt: skip

SCHOOL = load_map("parking_school_obstacles")
LEFT, RIGHT, LOW, HIGH = -0.975, 1.175, -0.625, 0.625  # inner faces of the walls
BOX = (0.7, 1.025, 0.2, 0.425)


def at(grid, field, x, y):
    return value_at(field, (x - grid.x_m) / grid.cell_m, (y - grid.y_m) / grid.cell_m)


def places(count=400):
    rng = np.random.default_rng(3)
    for x, y in rng.uniform((LEFT + 0.02, LOW + 0.02), (RIGHT - 0.02, HIGH - 0.02), (count, 2)):
        yield float(x), float(y)


def to_boxes(x, y):
    """Return the distance to the two boxes, 0 inside."""
    ahead = max(BOX[0] - x, x - BOX[1], 0.0)
    return min(math.hypot(ahead, max(BOX[2] - s * y, s * y - BOX[3], 0.0)) for s in (1, -1))


def test_distances_are_those_to_walls_and_boxes():
    grid, off = grid_of_city(SCHOOL), []
    for x, y in places():
        walls = min(x - LEFT, RIGHT - x, y - LOW, HIGH - y)
        if to_boxes(x, y) > 0.01:
            expected = min(walls, to_boxes(x, y))
            off += [
                at(grid, field, x, y) - expected for field in (grid.clearance_m, grid.to_face_m)
            ]
    assert np.quantile(np.abs(off), 0.9) < 0.0005
    assert np.abs(off).max() < grid.cell_m


def test_inside_a_box_clearance_is_minus_the_way_out():
    grid = grid_of_city(SCHOOL)
    assert at(grid, grid.clearance_m, 0.8625, 0.3125) == pytest.approx(-0.1125, abs=0.006)
    assert at(grid, grid.to_face_m, 0.8625, 0.3125) == pytest.approx(0.1125, abs=0.006)


def test_face_that_nobody_can_see_is_none():
    grid = grid_of_city(SCHOOL)
    outside = -1.0125  # in the wall, 12.5 mm from its outer face
    assert at(grid, grid.to_face_m, outside, 0.0) == pytest.approx(0.0375, abs=0.002)


def test_box_that_is_not_mapped_is_left_out():
    unmapped = replace(SCHOOL.boxes[0], mapped=False)
    grid = grid_of_city(replace(SCHOOL, boxes=(unmapped, SCHOOL.boxes[1])))
    free = grid_of_city(replace(SCHOOL, boxes=SCHOOL.boxes[1:]))
    np.testing.assert_array_equal(grid.cells, free.cells)
    assert at(grid, grid.clearance_m, unmapped.x_m, unmapped.y_m) > 0.2


def test_large_map_has_wider_cells(monkeypatch):
    monkeypatch.setattr("vehicle_agent.autonomy.grid_map.MAX_CELLS", 1000)
    grid = grid_of_city(SCHOOL)
    assert grid.cells.size < 1200
    assert at(grid, grid.clearance_m, 0.0, 0.0) == pytest.approx(HIGH, abs=grid.cell_m)


def test_map_without_anything_is_refused():
    with pytest.raises(MapError, match="expected a floor or walls"):
        grid_of_city(replace(SCHOOL, floor=None, walls=(), boxes=()))


def test_point_is_an_obstacle_but_no_face_of_the_map():
    grid = grid_of_city(SCHOOL)
    more = with_points(grid, np.array([[0.0, 0.0], [9.0, 9.0]]))
    assert at(more, more.clearance_m, 0.1, 0.0) == pytest.approx(0.1, abs=0.004)
    assert at(more, more.clearance_m, 0.0, 0.5) == pytest.approx(0.125, abs=0.004)
    assert (more.cells == OCCUPIED).sum() == (grid.cells == OCCUPIED).sum() + 1
    assert more.to_face_m is grid.to_face_m


def scanned(yaw=0.0):
    free, occupied = np.zeros((30, 40), bool), np.zeros((30, 40), bool)
    free[:, :20], occupied[10:12, 5] = True, True
    free[occupied] = False
    return OccupancyGrid("hall", free, occupied, 0.05, Pose2(-1.0, -0.5, yaw))


def test_scanned_grid_has_unknown_cells_where_no_car_may_be():
    grid = grid_of_scan(scanned())
    assert (grid.cells[:, 20:] == UNKNOWN).all()
    assert grid.cells[10, 5] == OCCUPIED
    assert grid.cells[0, 0] == FREE
    assert grid.clearance_m[20, 19] == pytest.approx(0.025)
    assert grid.clearance_m[20, 20] == pytest.approx(-0.025)
    assert grid.to_face_m[10, 15] == pytest.approx(0.5)
    assert (grid.x_m, grid.y_m) == (-1.0, -0.5)


def test_turned_scan_is_refused_with_words():
    with pytest.raises(MapError, match=r"hall: origin: expected a yaw of 0, got 0\.1 rad"):
        grid_of_scan(scanned(yaw=0.1))


def test_grid_without_obstacles_is_wide_open():
    grid = grid_of_cells(np.zeros((10, 10), np.int8), 0.1, 0.0, 0.0)
    assert (grid.clearance_m > 1.0).all()


def test_field_lies_between_the_middles_of_its_cells():
    field = np.array([[0.0, 1.0], [2.0, 3.0]])
    assert value_at(field, 0.5, 0.5) == 0.0
    assert value_at(field, 1.0, 0.5) == pytest.approx(0.5)
    assert value_at(field, 0.5, 1.0) == pytest.approx(1.0)
    assert math.isnan(value_at(field, 0.4, 1.0))
    assert math.isnan(value_at(field, 1.0, 1.6))


def test_ring_without_thickness_is_not_filled():
    ring = Wall(points=((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)), closed=True,
                thickness_m=0.0)  # fmt: skip
    grid = grid_of_city(replace(SCHOOL, walls=(ring,), boxes=()))
    row, column = (int((0.0 - c) / grid.cell_m) for c in (grid.y_m, grid.x_m))
    assert grid.cells[row, column] == FREE
    assert grid.clearance_m[row, column] == pytest.approx(0.5, abs=0.01)
