"""Turns a scanned grid into a map: the room that was scanned, its walls, and a place to start.

The walls are the faces between free and occupied cells, few and straight.
"""

import math
from array import array
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats, Ints
from scm.errors import MapError
from scm.maps.grid import OccupancyGrid, load_occupancy
from scm.records.city_map import CityMap, MapTag, Point, Spawn, Wall
from scm.records.floor import Floor

# Steps of an aslant wall vanish; the corners of a single cell, half its diagonal away, stay.
STRAIGHTEN_CELLS = 0.7
TAG_SIZE_M = 0.0762
CLEARANCE_M = 0.25
"""Round the place to start; and how near the origin a room must come where its cell is not free."""


class Room(NamedTuple):
    """A set of free cells that hang together by their edges.

    Attributes:
        cells: Shape (rows, columns), as those of the grid.
        rows: First row, and the row after the last.
        columns: Likewise.
        chosen: Why it is this one, and what is left out, in words.
    """

    cells: Bools
    rows: tuple[int, int]
    columns: tuple[int, int]
    chosen: str


def map_from_occupancy(yaml_path: str | Path) -> CityMap:
    """Return a map of a scanned room: its walls and floor, no lanes.

    The frame is the scan's, and the map's tag is thought to lie in its origin, where the robot
    stood at first. The spawn place "start" is the clear place next to it. `source` says which room
    it is and how cells were read.

    Raises:
        MapError: The scan cannot be read, or shows no free ground.
    """
    grid = load_occupancy(yaml_path)
    if not grid.free.any():
        occupied = int(grid.occupied.sum())
        found = (f"{occupied} occupied, {grid.free.size - occupied} unknown", *grid.notes)
        raise MapError(f"{yaml_path}: expected free cells, got none: {'; '.join(found)}")
    room = room_of(grid)
    corners = np.array([(c, r) for c in _beyond(room.columns) for r in _beyond(room.rows)])
    xs, ys = zip(*_places(grid, corners), strict=True)
    facts = (f"scanned grid {Path(yaml_path).name}, cells of {grid.cell_m:g} m", room.chosen)
    return CityMap(
        map=1,
        name=grid.name,
        title=grid.name.replace("_", " ").capitalize(),
        source="; ".join((*facts, *grid.notes)),
        floor=Floor(x_m=(min(xs), max(xs)), y_m=(min(ys), max(ys))),
        tag=MapTag(tag_id=0, size_m=TAG_SIZE_M),
        walls=walls_of(grid, room),
        spawns=start_of(grid, room),
    )


def _beyond(span: tuple[int, int]) -> tuple[int, int]:
    """Return a span of cells with one more on either side: the walls' own."""
    return span[0] - 1, span[1] + 1


def room_of(grid: OccupancyGrid) -> Room:
    """Return the room that holds the origin, where the robot stood at first.

    Where the origin's own cell is not free, it is the largest of those that come within a car's
    clearance of it, and otherwise the largest of all. There must be a free cell.
    """
    import cv2  # noqa: PLC0415  see scm.maps.grey

    _, found, found_facts, _ = cv2.connectedComponentsWithStats(
        grid.free.view(np.uint8), connectivity=4, ltype=cv2.CV_32S
    )
    labels, facts = np.asarray(found, np.int32), np.asarray(found_facts, np.int32)
    areas = facts[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0  # of what is not free
    label, why = _chosen(grid, labels, areas)
    low = facts[label, [cv2.CC_STAT_TOP, cv2.CC_STAT_LEFT]]
    high = low + facts[label, [cv2.CC_STAT_HEIGHT, cv2.CC_STAT_WIDTH]]
    rows, columns = zip(low.tolist(), high.tolist(), strict=True)
    chosen = f"the room is {why}, {_area(grid, areas[label])}"
    if others := len(areas) - 2:
        rest = _area(grid, areas.sum() - areas[label])
        chosen += f"; left out: {others} other free area{'s' * (others > 1)}, {rest}"
    return Room(labels == label, rows, columns, chosen)


def _area(grid: OccupancyGrid, cells: np.integer[Any]) -> str:
    area_m2 = int(cells) * grid.cell_m**2
    return f"{area_m2:.0f} m²" if area_m2 >= 100.0 else f"{area_m2:.3g} m²"


def _chosen(
    grid: OccupancyGrid, labels: NDArray[np.int32], areas: NDArray[np.int32]
) -> tuple[int, str]:
    """Return the label of the room that is meant, and why."""
    row, column = grid.cell_at(0.0, 0.0)
    rows, columns = labels.shape
    if 0 <= row < rows and 0 <= column < columns and labels[row, column]:
        return int(labels[row, column]), "the one that holds the origin"
    inside = grid.origin.inverse().apply(0.0, 0.0)
    above, beside = (
        np.maximum(0.0, np.abs(np.arange(count) + 0.5 - at / grid.cell_m) - 0.5) * grid.cell_m
        for count, at in ((rows, inside[1]), (columns, inside[0]))
    )
    near = np.ix_(above <= CLEARANCE_M, beside <= CLEARANCE_M)
    is_near = np.hypot(above[near[0]], beside[near[1]]) <= CLEARANCE_M
    candidates = np.unique(labels[near][is_near])
    candidates = candidates[candidates > 0]
    if candidates.size:
        best = int(candidates[areas[candidates].argmax()])
        return best, f"the largest within {CLEARANCE_M:g} m of the origin, whose cell is not free"
    return int(areas.argmax()), "the largest: no free cell is near the origin"


def _places(grid: OccupancyGrid, corners: NDArray[np.generic]) -> list[Point]:
    """Return corners (column, row) of the grid in the map frame [m], to 0.01 mm."""
    x0, y0, yaw = grid.origin
    along, up = (np.asarray(corners, np.float64) * grid.cell_m).T
    c, s = math.cos(yaw), math.sin(yaw)
    placed = np.round([x0 + c * along - s * up, y0 + s * along + c * up], 5)
    return [(x, y) for x, y in placed.T.tolist()]


def start_of(grid: OccupancyGrid, room: Room) -> tuple[Spawn, ...]:
    """Return the place nearest to the origin with free ground all round, if there is one."""
    import cv2  # noqa: PLC0415  see scm.maps.grey

    (top, bottom), (left, right) = room.rows, room.columns
    cells = np.pad(room.cells[top:bottom, left:right], 1).view(np.uint8)
    away = cv2.distanceTransform(cells, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    across, up = grid.origin.inverse().apply(0.0, 0.0)
    # Rounded, so that of four cells as near as each other the first is taken on every machine.
    x = np.arange(left, right) + 0.5 - round(across / grid.cell_m, 6)
    y = np.arange(top, bottom) + 0.5 - round(up / grid.cell_m, 6)
    is_clear = away * grid.cell_m > CLEARANCE_M + 1e-6
    squared = x**2 + y[:, None] ** 2
    squared[~is_clear] = np.inf
    row, column = np.unravel_index(int(squared.argmin()), squared.shape)
    if not is_clear[row, column]:
        return ()
    middle = np.array([[left + column + 0.5, top + row + 0.5]])
    return (Spawn(name="start", pose=(*_places(grid, middle)[0], 0.0)),)


def walls_of(grid: OccupancyGrid, room: Room | None = None) -> tuple[Wall, ...]:
    """Return the walls of a room, else of the one that holds the origin, without thickness.

    A face follows the edges between free and occupied cells and is straightened within most of
    a cell. Where the scan ends in unknown cells there is no wall.
    """
    room = room or room_of(grid)
    corners, begins = _chains(_faces(room.cells, grid.occupied))
    if not begins.size:
        return ()
    lasts = np.append(begins[1:], len(corners)) - 1
    is_closed = (corners[begins] == corners[lasts]).all(axis=1)
    is_corner = _straightened(corners, begins, lasts, is_closed)
    points = _places(grid, corners[is_corner])
    bounds = np.append(0, np.cumsum(np.add.reduceat(is_corner, begins, dtype=np.int64))).tolist()
    return tuple(
        Wall(points=tuple(points[low : high - closed]), closed=closed, thickness_m=0.0)
        for low, high, closed in zip(bounds[:-1], bounds[1:], is_closed.tolist(), strict=True)
    )


class _Faces(NamedTuple):
    """Straight faces between a room and walls, the room on their left, in the order of `start`.

    A corner has the number (column + row) * width + column, so a ring's lowest is its lower left.

    Attributes:
        start: Corner at which each begins, shape (n,).
        end: Corner at which it ends.
        way: 0 right, 1 up, 2 left, 3 down.
        width: Corners in a row.
    """

    start: Ints
    end: Ints
    way: Ints
    width: int


def _faces(room: Bools, occupied: Bools) -> _Faces:
    """Return the faces of a room."""
    inside, wall = np.pad(room, 1), np.pad(occupied, 1)
    width = room.shape[1] + 1
    starts, ends, ways = list[Ints](), list[Ints](), list[Ints]()
    for way, side in enumerate(((-1, 0), (0, 1), (1, 0), (0, -1))):
        beside = inside[1:-1, 1:-1] & wall[1 + side[0] :, 1 + side[1] :][: len(room), : width - 1]
        lines, lows, highs = _runs(beside.T if way in {1, 3} else beside)
        lines += way in {1, 2}  # the far edge of the cell
        tails, heads = (lows, highs) if way in {0, 1} else (highs, lows)
        for numbers, places in ((starts, tails), (ends, heads)):
            columns = lines if way in {1, 3} else places
            numbers.append((lines + places) * width + columns)
        ways.append(np.full(len(lines), way))
    start = np.concatenate(starts)
    order = np.argsort(start, kind="stable")
    return _Faces(start[order], np.concatenate(ends)[order], np.concatenate(ways)[order], width)


def _runs(cells: Bools) -> tuple[Ints, Ints, Ints]:
    """Return row, first column and the column after the last of each run along a row."""
    steps = np.diff(np.pad(cells, ((0, 0), (1, 1))).view(np.int8), axis=1)
    rows, lows = np.nonzero(steps == 1)
    return rows, lows, np.nonzero(steps == -1)[1]


def _chains(faces: _Faces) -> tuple[Ints, Ints]:
    """Return the corners of faces joined to chains, and the index at which each chain begins.

    Returns:
        Corners, shape (n, 2): column and row; a closed chain ends with its first one again.
    """
    following = _following(faces)
    is_first = np.ones(len(following), np.bool_)
    is_first[following[following >= 0]] = False
    is_left = bytearray(b"\1") * len(following)
    start, end, after = (numbers.data for numbers in (faces.start, faces.end, following))
    numbers, begins = array("q"), array("q")
    for first in (*np.flatnonzero(is_first).tolist(), *range(len(following))):
        if not is_left[first]:
            continue
        begins.append(len(numbers))
        face = first
        while face >= 0 and is_left[face]:
            is_left[face] = False
            numbers.append(start[face])
            last, face = face, after[face]
        numbers.append(end[last])
    diagonal, columns = np.divmod(np.asarray(numbers, np.int64), faces.width)
    return np.stack([columns, diagonal - columns], axis=1), np.asarray(begins, np.int64)


def _following(faces: _Faces) -> Ints:
    """Return the face that goes on where each one ends; -1: none does."""
    after = np.searchsorted(faces.start, faces.end)
    start, way = np.append(faces.start, [-1, -1]), np.append(faces.way, [-1, -1])
    # Where two rooms' corners touch, the left turn stays with this one.
    is_second = (start[after + 1] == faces.end) & (way[after + 1] == (faces.way + 1) % 4)
    return np.where(start[after] == faces.end, after + is_second, -1)


def _straightened(corners: Ints, begins: Ints, lasts: Ints, is_closed: Bools) -> Bools:
    """Return which corners stay: the fewest that leave none further than the tolerance beside.

    All chains are divided at once (Douglas and Peucker), a closed one first at the corner that is
    furthest from its first.
    """
    is_corner = np.zeros(len(corners), np.bool_)
    is_corner[begins] = is_corner[lasts] = True
    is_long = lasts - begins > 1
    low, high, is_far = begins[is_long], lasts[is_long], is_closed[is_long]
    while low.size:
        index, of = _between(low, high)
        away = _distances(corners, index, low[of], high[of])
        furthest = np.maximum.reduceat(away, np.searchsorted(of, np.arange(len(low))))
        is_furthest = np.flatnonzero(away == furthest[of])
        middle = index[is_furthest[np.searchsorted(of[is_furthest], np.arange(len(low)))]]
        divides = (furthest > STRAIGHTEN_CELLS) | is_far
        is_corner[middle[divides]] = True
        low, middle, high = low[divides], middle[divides], high[divides]
        low, high = np.append(low, middle), np.append(middle, high)
        low, high = low[high - low > 1], high[high - low > 1]
        is_far = np.zeros(len(low), np.bool_)
    return is_corner


def _between(low: Ints, high: Ints) -> tuple[Ints, Ints]:
    """Return the indices between each low and high, and of which pair each is."""
    counts = high - low - 1
    of = np.repeat(np.arange(len(low)), counts)
    return np.arange(len(of)) + (low + 1 - (np.cumsum(counts) - counts))[of], of


def _distances(corners: Ints, index: Ints, low: Ints, high: Ints) -> Floats:
    """Return how far corners lie from the straight between two others each [cells]."""
    across, along = (corners[index] - corners[low]).T, (corners[high] - corners[low]).T
    length = np.hypot(*along)
    area = np.abs(along[0] * across[1] - along[1] * across[0])
    from_line: Floats = area / np.maximum(length, 1.0)
    return np.asarray(np.where(length > 0.0, from_line, np.hypot(*across)), np.float64)
