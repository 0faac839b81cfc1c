"""Rooms in which cars park: that of a map, of a scan, and random parking lots.

A lot has one or two aisles between rows of bays, cars in some bays, and pillars:

    +-----------------------------+
    | [] [] __ [] o [] __ [] [] o |   [] a car, __ a free bay, o a pillar
    |            aisle            |
    | __ [] o [] [] __ [] [] goal |
    +-----------------------------+
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.errors import PathError
from scm.geometry import Pose2
from scm.maps.grid import load_occupancy
from scm.maps.load import is_scan, load_map
from scm.maps.occupancy import room_of
from scm.maps.route import roads_of
from scm.records.city_map import Bay, Box, CityMap, MapTag, Spawn, Wall
from scm.records.floor import Floor
from studies.parking import on_floor
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, GridMap, grid_of_cells, grid_of_city
from vehicle_agent.autonomy.hybrid_astar import plan
from vehicle_agent.autonomy.outline import outline_clearance, scene_of
from vehicle_agent.autonomy.plan import CarLimits

LOT = "lot"
TRIES = 2000
BESIDE_M = (0.05, 0.15)  # from the nearest thing: a goal that is drawn
BAY_M, BAY_DEPTH_M = (0.32, 0.5), 0.45  # across: 1.8 to 2.9 widths of a car
BAYS, AISLE_M, END_M = (4, 10), (0.6, 1.4), (0.3, 0.9)  # in a row; between rows; beside them
TAKEN = (0.3, 0.9)  # share of bays with a car in them
CAR_M, CAR_MIDDLE_M = (0.3, 0.175), 0.08  # of a Nigel: outline, and its middle ahead of the axle
CAR_STD = (0.015, 0.015, 0.04)  # of a car in its bay [m, m, rad]
PILLAR_M, PILLARS = (0.06, 0.1), 0.3  # edge; share of the lines between bays that have one
WALL_M, TAG_M = 0.05, 0.0762


class Room(NamedTuple):
    """Where a car parks.

    Attributes:
        city_map: The map.
        goal: Of the rear axle.
        draw: Draws where a car may start; it may lie in an obstacle.
    """

    city_map: CityMap
    goal: Pose2
    draw: Callable[[np.random.Generator], Pose2]


def room_named(name: str, goal: str, limits: CarLimits, rng: np.random.Generator) -> Room:
    """Return a room.

    Args:
        name: `lot`: a random one; a scan's `.yaml`; a map by name or path.
        goal: Place of the map. A scan has none: a place beside a wall is drawn.
        limits: Of the car that parks.
        rng: Of all that is drawn.

    Raises:
        MapError: when there is no such map, or it has no such place.
        PathError: when no goal can be reached.
    """
    if is_scan(name):
        return _scanned(name, limits, rng)
    city_map = random_lot(rng) if name == LOT else load_map(name)
    return Room(city_map, roads_of(city_map).spawn_pose(goal), partial(on_floor, city_map))


def _scanned(path: str, limits: CarLimits, rng: np.random.Generator) -> Room:
    """Return a scanned room with a goal beside a wall: one that the room's `start` leads to."""
    city_map, seen = load_map(path), seen_floor(path)
    scene = scene_of(seen, limits)
    grid, start = grid_of_city(city_map), roads_of(city_map).spawn_pose("start")
    for _ in range(TRIES):
        goal = _seen(seen, rng)
        if not BESIDE_M[0] < outline_clearance(scene, goal) < BESIDE_M[1]:
            continue
        try:
            plan(grid, limits, start, goal, margin_m=0.03)
        except PathError:
            continue
        return Room(city_map, goal, partial(_clear, seen, limits))
    raise PathError(f"{path}: no goal beside a wall that can be reached in {TRIES} draws")


def seen_floor(path: str | Path) -> GridMap:
    """Return the room of a scan: cells that the scanner saw free and that hang together."""
    scan = load_occupancy(path)
    cells = np.where(room_of(scan).cells, FREE, OCCUPIED).astype(np.int8)
    return grid_of_cells(cells, scan.cell_m, scan.origin.x, scan.origin.y)


def _seen(grid: GridMap, rng: np.random.Generator) -> Pose2:
    """Draw a pose whose rear axle is on free cells."""
    rows, columns = np.nonzero(grid.cells == FREE)
    one = rng.integers(len(rows))
    x, y = (np.array((columns[one], rows[one])) + rng.uniform(size=2)) * grid.cell_m
    return Pose2(float(grid.x_m + x), float(grid.y_m + y), float(rng.uniform(-math.pi, math.pi)))


def _clear(grid: GridMap, limits: CarLimits, rng: np.random.Generator) -> Pose2:
    """Draw a pose whose outline is on free cells."""
    scene = scene_of(grid, limits)
    poses = (_seen(grid, rng) for _ in range(TRIES))
    return next(pose for pose in poses if outline_clearance(scene, pose) > 0.0)


class _Row(NamedTuple):
    """A row of bays: where they open, and to which side."""

    y_m: float
    faces: float


def random_lot(rng: np.random.Generator) -> CityMap:
    """Return a walled parking lot; the place `goal` is a free bay, nose or tail to its end."""
    count = int(rng.integers(BAYS[0], BAYS[1] + 1))
    bay_m, ends = float(rng.uniform(*BAY_M)), rng.uniform(*END_M, size=2)
    rows, high = _rows(rng)
    long = float(ends.sum()) + count * bay_m
    lines = float(ends[0]) + bay_m * np.arange(count + 1)
    places = [(float(x) + 0.5 * bay_m, row) for row in rows for x in lines[:-1]]
    poses = [_parked(x, row, rng) for x, row in places]
    goal = int(rng.integers(len(poses)))
    taken = rng.uniform(size=len(poses)) < rng.uniform(*TAKEN)
    taken[goal] = False
    cars = [_car(number, poses[number], rng) for number in np.flatnonzero(taken).tolist()]
    bays = (Bay(name=f"bay_{n}", pose=tuple(pose), width_m=bay_m) for n, pose in enumerate(poses))
    corners = ((0.0, 0.0), (long, 0.0), (long, high), (0.0, high))
    return CityMap(
        map=1, name=LOT, title="Random parking lot", source="drawn by chance",
        floor=Floor(x_m=(-WALL_M, long + WALL_M), y_m=(-WALL_M, high + WALL_M)),
        tag=MapTag(tag_id=0, x_m=0.1, y_m=0.1, size_m=TAG_M),
        walls=(Wall(points=corners, closed=True, thickness_m=WALL_M),),
        boxes=(*cars, *_pillars(lines[1:-1], rows, rng)),
        bays=tuple(bays),
        spawns=(Spawn(name="goal", pose=tuple(poses[goal])),),
    )  # fmt: skip


def _rows(rng: np.random.Generator) -> tuple[list[_Row], float]:
    """Return the rows on both sides of one aisle or two, and how far the lot reaches [m]."""
    rows, y = list[_Row](), 0.0
    for _ in range(int(rng.integers(1, 3))):
        low = y + BAY_DEPTH_M
        y = low + float(rng.uniform(*AISLE_M))
        rows += [_Row(low, 1.0), _Row(y, -1.0)]
        y += BAY_DEPTH_M
    return rows, y


def _parked(x_m: float, row: _Row, rng: np.random.Generator) -> Pose2:
    """Return the rear axle of a car in a bay, nose or tail to the aisle."""
    nose = float(rng.choice((-1.0, 1.0)))
    middle = row.y_m - row.faces * 0.5 * BAY_DEPTH_M
    return Pose2(x_m, middle - nose * row.faces * CAR_MIDDLE_M, nose * row.faces * 0.5 * math.pi)


def _car(number: int, pose: Pose2, rng: np.random.Generator) -> Box:
    off = Pose2(*(np.array(CAR_STD) * rng.standard_normal(3)).tolist())
    x, y, yaw = pose @ off @ Pose2(CAR_MIDDLE_M, 0.0, 0.0)
    length_m, width_m = CAR_M
    return Box(name=f"car_{number}", x_m=x, y_m=y, yaw_rad=yaw, length_m=length_m, width_m=width_m)


def _pillars(lines: np.ndarray, rows: list[_Row], rng: np.random.Generator) -> Iterator[Box]:
    """Yield pillars between bays, at their end towards the aisle."""
    for number, row in enumerate(rows):
        for k, x in enumerate(lines.tolist()):
            edge = float(rng.uniform(*PILLAR_M))
            if rng.uniform() < PILLARS:
                y = row.y_m - row.faces * 0.5 * edge
                yield Box(name=f"pillar_{number}_{k}", x_m=x, y_m=y, length_m=edge, width_m=edge)
