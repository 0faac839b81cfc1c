from pathlib import Path

import numpy as np
import pytest

import scm
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.grid import OccupancyGrid, load_occupancy
from scm.maps.load import load_map
from scm.maps.occupancy import map_from_occupancy, walls_of
from scm.maps.segments import wall_segments

SCANS = Path(scm.__file__).parent.parent.parent / "shared" / "data" / "slam_maps"
REAL = ("bedroom", "living_room", "parking_school_testbed")

needs_scans = pytest.mark.skipif(not SCANS.is_dir(), reason=f"no recorded scans at {SCANS}")


def grid_of(rows, cell_m=1.0, origin=Pose2(0.0, 0.0, 0.0)):  # noqa: B008  a tuple: never changed
    """Return a grid from text, top row first: # occupied, . free, anything else unknown."""
    cells = np.array([list(row) for row in rows])[::-1]
    return OccupancyGrid("text", cells == ".", cells == "#", cell_m, origin)


def scan(tmp_path, pgm, **changes):
    keys = {
        "image": "room.pgm",
        "resolution": 0.05,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | changes
    (tmp_path / "room.pgm").write_bytes(pgm)
    path = tmp_path / "room.yaml"
    lines = [f"{key}: {value}\n" for key, value in keys.items() if value is not None]
    path.write_text("".join(lines), encoding="utf-8")
    return path


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


def test_only_the_largest_room_counts():
    walls = walls_of(grid_of(["########", "#....#.#", "########"]))
    assert len(walls) == 1
    assert max(x for x, _ in walls[0].points) == 5.0


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


@pytest.mark.parametrize("kind", ["P5", "P2"])
def test_binary_and_text_pictures_are_read(tmp_path, kind):
    body = bytes([0, 254, 205, 0]) if kind == "P5" else b"0 254\n205 0\n"
    grid = load_occupancy(scan(tmp_path, kind.encode() + b"\n# made by hand\n2 2\n255\n" + body))
    assert grid.occupied.tolist() == [[False, True], [True, False]]
    assert grid.free.tolist() == [[False, False], [False, True]]


def test_negate_swaps_black_and_white(tmp_path):
    grid = load_occupancy(scan(tmp_path, b"P5 1 1 255\n\xff", negate=1))
    assert grid.occupied.all()


@pytest.mark.parametrize(
    ("pgm", "changes", "words"),
    [
        (b"P6 1 1 255\n\xff", {}, "expected a PGM picture"),
        (b"P5 3 3 255\n\xff", {}, "expected 3 x 3 pixels, got 1"),
        (b"P5 1 1 255\n\xff", {"resolution": "fine"}, "resolution: expected a finite number"),
        (b"P5 1 1 255\n\xff", {"resolution": 0}, "resolution: expected more than 0"),
        (b"P5 1 1 255\n\xff", {"origin": "[0, 0]"}, r"origin: expected \[x, y, yaw\]"),
        (b"P5 1 1 255\n\xff", {"origin": None}, "key origin is missing"),
        (b"P5 1 1 255\n\xff", {"image": "none.pgm"}, "none.pgm: cannot be read"),
        (b"P5 1 1 255\n\xff", {"mode": "raw"}, "mode: expected trinary, got 'raw'"),
        (b"P5 1 1 255\n\x00", {}, "expected free cells, got none"),
    ],
)
def test_a_bad_scan_is_refused(tmp_path, pgm, changes, words):
    with pytest.raises(MapError, match=words):
        map_from_occupancy(scan(tmp_path, pgm, **changes))


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
    assert grid.is_free(start.pose[0], start.pose[1])


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
