"""Turns a scanned grid into walls: the faces between free and occupied cells, few and straight."""

import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from scm.arrays import Bools
from scm.errors import MapError
from scm.maps.grid import OccupancyGrid, load_occupancy
from scm.maps.model import CityMap, Floor, MapTag, Point, Spawn, Wall

Corner = tuple[int, int]

# Steps of an aslant wall vanish; the corners of a single cell, half its diagonal away, stay.
STRAIGHTEN_CELLS = 0.7
TAG_SIZE_M = 0.0762
START_CLEARANCE_M = 0.25


def map_from_occupancy(yaml_path: str | Path) -> CityMap:
    """Return a map of a scanned room: its walls and floor, no lanes.

    The frame is the scan's, and the map's tag is thought to lie in its origin, where the robot
    stood at first. The spawn place "start" is the clear place next to it.

    Raises:
        MapError: The scan cannot be read, or shows no free ground.
    """
    grid = load_occupancy(yaml_path)
    rows, columns = np.nonzero(_room(grid))
    if rows.size == 0:
        raise MapError(f"{yaml_path}: expected free cells, got none")
    low_column, high_column = int(columns.min()) - 1, int(columns.max()) + 2
    low_row, high_row = int(rows.min()) - 1, int(rows.max()) + 2
    corners = [_place(grid, (c, r)) for c in (low_column, high_column) for r in (low_row, high_row)]
    xs, ys = zip(*corners, strict=True)
    return CityMap(
        map=1,
        name=grid.name,
        title=grid.name.replace("_", " ").capitalize(),
        source=f"scanned grid {Path(yaml_path).name}, cells of {grid.cell_m:g} m",
        floor=Floor(x_m=(min(xs), max(xs)), y_m=(min(ys), max(ys))),
        tag=MapTag(tag_id=0, size_m=TAG_SIZE_M),
        walls=walls_of(grid),
        spawns=_start(grid),
    )


def walls_of(grid: OccupancyGrid) -> tuple[Wall, ...]:
    """Return the walls of the largest connected free room, as faces without thickness.

    A face follows the edges between free and occupied cells and is straightened within most of
    a cell. Where the scan ends in unknown cells there is no wall.
    """
    walls = []
    for chain in _chains(_faces(_room(grid), grid.occupied)):
        closed = chain[0] == chain[-1]
        kept = _straighten_ring(chain[:-1]) if closed else _straighten(chain)
        points = tuple(_place(grid, corner) for corner in kept)
        walls.append(Wall(points=points, closed=closed, thickness_m=0.0))
    return tuple(walls)


def _place(grid: OccupancyGrid, corner: Corner) -> Point:
    """Return a corner of the grid in the map frame [m], to 0.01 mm."""
    x, y = grid.origin.apply(corner[0] * grid.cell_m, corner[1] * grid.cell_m)
    return round(x, 5), round(y, 5)


def _start(grid: OccupancyGrid) -> tuple[Spawn, ...]:
    """Return the place nearest to the origin with free ground all round, if there is one."""
    step, reach = grid.cell_m, math.ceil(START_CLEARANCE_M / grid.cell_m)
    clear = np.pad(_room(grid), reach)
    disc = [
        (row, column)
        for row in range(-reach, reach + 1)
        for column in range(-reach, reach + 1)
        if math.hypot(row, column) * step <= START_CLEARANCE_M
    ]
    clear = np.logical_and.reduce([np.roll(clear, offset, axis=(0, 1)) for offset in disc])
    middles = [
        grid.origin.apply((c - reach + 0.5) * step, (r - reach + 0.5) * step)
        for r, c in np.argwhere(clear).tolist()
    ]
    if not middles:
        return ()
    x, y = min(middles, key=lambda middle: math.hypot(*middle))
    return (Spawn(name="start", pose=(round(x, 5), round(y, 5), 0.0)),)


def _room(grid: OccupancyGrid) -> Bools:
    """Return the largest set of free cells that hang together by their edges."""
    left = grid.free.copy()
    largest: list[Corner] = []
    while left.any():
        row, column = (int(i) for i in np.argwhere(left)[0])
        room, queue = [], [(row, column)]
        left[row, column] = False
        while queue:
            row, column = queue.pop()
            room.append((row, column))
            for r, c in (
                (row + 1, column),
                (row - 1, column),
                (row, column + 1),
                (row, column - 1),
            ):
                if 0 <= r < left.shape[0] and 0 <= c < left.shape[1] and left[r, c]:
                    left[r, c] = False
                    queue.append((r, c))
        largest = max(largest, room, key=len)
    cells = np.zeros_like(left)
    if largest:
        rows, columns = zip(*largest, strict=True)
        cells[list(rows), list(columns)] = True
    return cells


def _faces(room: Bools, occupied: Bools) -> dict[Corner, list[Corner]]:
    """Return directed cell edges (from corner to corners, the room on the left) with a wall."""
    inside, wall = np.pad(room, 1), np.pad(occupied, 1)
    faces: dict[Corner, list[Corner]] = defaultdict(list)
    # (row step, column step) to the wall's cell, and the edge's ends (column, row) from the cell.
    sides = (
        ((-1, 0), (0, 0), (1, 0)),
        ((0, 1), (1, 0), (1, 1)),
        ((1, 0), (1, 1), (0, 1)),
        ((0, -1), (0, 1), (0, 0)),
    )
    for (dr, dc), start, end in sides:
        beside = inside & np.roll(wall, (-dr, -dc), axis=(0, 1))
        for row, column in np.argwhere(beside) - 1:
            r, c = int(row), int(column)
            faces[c + start[0], r + start[1]].append((c + end[0], r + end[1]))
    return faces


def _chains(faces: dict[Corner, list[Corner]]) -> list[list[Corner]]:
    """Return the edges joined to chains; a closed one ends where it began."""
    ends = [end for following in faces.values() for end in following]
    entered: dict[Corner, int] = defaultdict(int)
    for end in ends:
        entered[end] += 1
    begins = [start for start, out in sorted(faces.items()) if len(out) > entered[start]]
    chains = [_follow(start, faces) for start in begins]
    for start in sorted(faces):
        while faces[start]:
            chains.append(_follow(start, faces))
    return chains


def _follow(start: Corner, faces: dict[Corner, list[Corner]]) -> list[Corner]:
    """Take edges out of `faces`, one after the other, until there is none or the ring is closed."""
    chain = [start]
    while faces.get(chain[-1]):
        here = chain[-1]
        ways = faces[here]
        before = chain[-2] if len(chain) > 1 else here
        # Where two rooms' corners touch, the sharpest left turn stays with this one.
        way = max(ways, key=lambda to: _turn(before, here, to))
        ways.remove(way)
        chain.append(way)
        if way == start:
            break
    return chain


def _turn(before: Corner, here: Corner, to: Corner) -> int:
    """Return the cross product of the way in and the way out: + = left."""
    return (here[0] - before[0]) * (to[1] - here[1]) - (here[1] - before[1]) * (to[0] - here[0])


def _straighten_ring(ring: list[Corner]) -> list[Corner]:
    """Straighten a closed chain, given without its repeated end."""
    first = min(range(len(ring)), key=lambda i: (ring[i][0] + ring[i][1], ring[i]))
    far = max(range(len(ring)), key=lambda i: math.dist(ring[first], ring[i]))
    low, high = sorted((first, far))
    one, other = ring[low : high + 1], ring[high:] + ring[: low + 1]
    return _straighten(one)[:-1] + _straighten(other)[:-1]


def _straighten(chain: list[Corner]) -> list[Corner]:
    """Return the fewest of a chain's corners that leave none further than the tolerance beside."""
    keep = {0, len(chain) - 1}
    stretches = [(0, len(chain) - 1)]
    while stretches:
        low, high = stretches.pop()
        away = [_distance(chain[i], chain[low], chain[high]) for i in range(low + 1, high)]
        if away and max(away) > STRAIGHTEN_CELLS:
            middle = low + 1 + away.index(max(away))
            keep.add(middle)
            stretches += [(low, middle), (middle, high)]
    return [chain[i] for i in sorted(keep)]


def _distance(point: Corner, start: Corner, end: Corner) -> float:
    """Return the distance of a point from the straight between two others [cells]."""
    length = math.dist(start, end)
    if length == 0.0:
        return math.dist(start, point)
    dx, dy = end[0] - start[0], end[1] - start[1]
    return abs(dx * (point[1] - start[1]) - dy * (point[0] - start[0])) / length
