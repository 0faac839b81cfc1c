from pathlib import Path

import cv2
import numpy as np
import pytest

import scm
from scm.geometry import Pose2
from scm.maps.grid import OccupancyGrid, load_occupancy
from scm.maps.load import load_map
from scm.maps.occupancy import room_of, start_of, walls_of
from scm.maps.segments import wall_segments

SCANS = Path(scm.__file__).parent.parent.parent / "shared" / "data" / "slam_maps"
REAL = ("bedroom", "living_room", "parking_school_testbed")

needs_scans = pytest.mark.skipif(not SCANS.is_dir(), reason=f"no recorded scans at {SCANS}")


def grid_of(rows, cell_m=1.0, origin=Pose2(0.0, 0.0, 0.0)):  # noqa: B008  a tuple: never changed
    """Return a grid from text, top row first: # occupied, . free, anything else unknown."""
    cells = np.array([list(row) for row in rows])[::-1]
    return OccupancyGrid("text", cells == ".", cells == "#", cell_m, origin)


def test_a_room_becomes_one_closed_wall_with_four_corners():
    (wall,) = walls_of(grid_of(["#####", "#...#", "#...#", "#####"]))
    assert wall.closed
    assert set(wall.points) == {(1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)}


def test_a_pillar_becomes_a_wall_of_its_own():
    walls = walls_of(grid_of(["#######", "#.....#", "#..#..#", "#.....#", "#######"]))
    pillar = min(walls, key=lambda wall: np.ptp([x for x, _ in wall.points]))
    assert len(walls) == 2
    assert set(pillar.points) == {(3.0, 2.0), (4.0, 2.0), (4.0, 3.0), (3.0, 3.0)}


def test_the_unknown_is_no_wall():
    (wall,) = walls_of(grid_of(["####", "#..?", "####"]))
    assert not wall.closed
    assert len(wall.points) == 4


def test_a_wall_aslant_is_straightened():
    rows = ["." * 40 for _ in range(8)]
    slope = ["".join("#" if x // 10 + 2 == y else "." for x in range(40)) for y in range(8)]
    rows = ["#" * 42] + ["#" + row + "#" for row in slope] + ["#" * 42]
    walls = walls_of(grid_of(rows))
    assert sum(len(wall.points) for wall in walls) <= 20


def test_the_frame_of_the_scan_is_kept():
    quarter = Pose2(5.0, 0.0, np.pi / 2)
    (wall,) = walls_of(grid_of(["###", "#.#", "###"], cell_m=0.5, origin=quarter))
    assert (4.5, 0.5) in wall.points
    assert (4.0, 1.0) in wall.points


def scanned_room(outside, origin):
    """Return a walled room of 3.61 m² in a picture of 30 m²; `outside` is what lies around it."""
    cells = np.full((100, 120), outside)
    cells[30:70, 40:80] = "#"
    cells[31:69, 41:79] = "."
    return OccupancyGrid("room", cells == ".", cells == "#", 0.05, Pose2(*origin))


@pytest.mark.parametrize(
    ("origin", "side_cells", "why"),
    [
        ((-3.0, -2.5, 0.0), 38, "the one that holds the origin, 3.61 m²; left out: 1 other free"),
        ((-2.5, 3.0, -np.pi / 2), 38, "the one that holds the origin, 3.61 m²"),
        ((0.0, 0.0, 0.0), 100, "the one that holds the origin, 26 m²"),
        # On the wall, with the room on the one side and all else on the other.
        ((-2.02, -2.5, 0.0), 100, "the largest within 0.25 m of the origin, whose cell is not"),
        ((9.0, 9.0, 0.0), 100, "the largest: no free cell is near the origin"),
    ],
)
def test_the_room_is_the_one_that_holds_the_origin(origin, side_cells, why):
    found = room_of(scanned_room(".", origin))
    assert found.rows[1] - found.rows[0] == side_cells
    assert found.chosen.startswith(f"the room is {why}")


def test_a_map_says_which_room_it_is_and_starts_at_the_origin(tmp_path):
    cells = np.full((100, 120), 205, np.uint8)
    cells[30:70, 40:80] = 0
    cells[31:69, 41:79] = 254
    cv2.imwrite(str(tmp_path / "room.png"), cells)
    (tmp_path / "room.yaml").write_text(
        "image: room.png\nmode: trinary\nresolution: 0.05\norigin: [-3.0, -2.5, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n",
        encoding="utf-8",
    )
    city_map = load_map(tmp_path / "room.yaml")
    assert (city_map.floor.x_m, city_map.floor.y_m) == ((-1.0, 1.0), (-1.0, 1.0))
    assert city_map.spawns[0].pose == (-0.025, -0.025, 0.0)
    assert "the one that holds the origin, 3.61 m²; 10400 cells of grey 205" in city_map.source


def test_the_start_is_as_clear_as_a_car_needs_and_as_near_the_origin_as_can_be():
    grid = scanned_room("?", (-2.05, -2.5, 0.0))  # the room begins at x = 0
    (start,) = start_of(grid, room_of(grid))
    # Five cells of 0.05 m lie between its own and the wall's.
    assert start.pose == pytest.approx((0.275, -0.025, 0.0))
    narrow = grid_of(["######", "......", "######"], cell_m=0.2)
    assert start_of(narrow, room_of(narrow)) == ()


def test_thousands_of_specks_become_a_wall_each():
    free = np.zeros((242, 242), np.bool_)
    free[1:-1, 1:-1] = True
    free[3:-3:4, 3:-3:4] = False
    walls = walls_of(OccupancyGrid("specks", free, ~free, 0.05, Pose2(-6.0, -6.0, 0.0)))
    assert [len(wall.points) for wall in walls] == [4] * (1 + 59 * 59)
    assert all(wall.closed for wall in walls)


@needs_scans
def test_the_perfect_scan_and_the_map_by_hand_have_the_same_walls():
    scanned = load_map(SCANS / "parking_school_perfect_simulator.yaml")
    by_hand = wall_segments(load_map("parking_school"))
    faces = wall_segments(scanned)
    assert len(faces) == 4
    for face in faces:
        off = np.abs(by_hand - face).max(axis=1)
        turned = np.abs(by_hand - face[[2, 3, 0, 1]]).max(axis=1)
        # Half a cell is what a scan of this grid can tell.
        assert min(off.min(), turned.min()) <= 0.025


@needs_scans
def test_the_boxes_by_hand_stand_where_the_scan_shows_them():
    faces = wall_segments(load_map(SCANS / "parking_school_obstacles_simulator.yaml"))
    by_hand = load_map("parking_school_obstacles")
    for box in by_hand.boxes:
        left, inner = box.x_m - box.length_m / 2 + 0.4, abs(box.y_m) - box.width_m / 2
        assert np.abs(faces[:, 0] - left).min() <= 0.03
        assert np.abs(np.abs(faces[:, 1]) - inner).min() <= 0.03


@needs_scans
@pytest.mark.parametrize("name", REAL)
def test_real_scans_become_compact_walls_and_a_place_to_start(name):
    grid = load_occupancy(SCANS / f"{name}.yaml")
    city_map = load_map(SCANS / f"{name}.yaml")
    # Fewer than half as many faces as occupied cells.
    assert 3 < len(wall_segments(city_map)) < grid.occupied.sum() / 2
    (start,) = city_map.spawns
    assert grid.free[grid.cell_at(*start.pose[:2])]


@needs_scans
def test_straightened_walls_stay_within_a_cell_of_what_was_scanned():
    path = SCANS / "parking_school_testbed.yaml"
    grid, segments = load_occupancy(path), wall_segments(load_map(path))
    rows, columns = np.nonzero(grid.occupied)
    cells = np.array([columns + 0.5, rows + 0.5]).T * grid.cell_m + np.array(grid.origin[:2])
    for x0, y0, x1, y1 in segments:
        for t in np.linspace(0.0, 1.0, 20):
            point = (x0 + t * (x1 - x0), y0 + t * (y1 - y0))
            assert np.hypot(*(cells - point).T).min() < 1.5 * grid.cell_m
