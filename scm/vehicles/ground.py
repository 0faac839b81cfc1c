"""The ground of a map for fleets: grip, rolling resistance, heights, and wind.

The world and every agent build a `Ground` from the same map and get the same floor and wind. On a
map without floor data and wind it does nothing.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.maps.floor_shapes import outline_of, pieces_of
from scm.maps.grey import full_scale, unpack
from scm.records.city_map import CityMap, Point
from scm.records.floor import Floor
from scm.vehicles.car import Car
from scm.vehicles.fleet import Fleet
from scm.vehicles.ground_kernel import ANYTHING, CLIMBS, Sheet, feel
from scm.vehicles.slope_hold import standing
from scm.vehicles.wind import Gusts

CELL_M = 0.25
MAX_CELLS = 1_000_000  # larger ones on a larger floor
WHEEL_REACH_M = 0.25  # wheels this large touch an edge before their centre is in its cell
CAR_REACH_M = 1.5  # a car this long reaches a cell with its front wheels

Bounds = tuple[float, float, float, float]


class Ground:
    """One map's floor and air.

    Args:
        city_map: The city.
        seed: Of the gusts; the same seed gives the same wind.

    Attributes:
        is_flat: Whether the floor is level and has nominal friction everywhere.
        has_no_wind: Whether there is no wind.
    """

    def __init__(self, city_map: CityMap, seed: int = 0) -> None:
        floor, wind = city_map.floor, city_map.wind
        self._is_level = floor.is_level
        self.is_flat = (
            floor.is_level
            and not (floor.patches or floor.friction_map)
            and (floor.grip, floor.rolling) == (1.0, 0.0)
        )
        self.has_no_wind = not (wind.x_mps or wind.y_mps or wind.gust_mps)
        self._sheet = None if self.is_flat else sheet_of(floor)
        self._gusts = None if self.has_no_wind else Gusts(wind, seed)

    def fit(self, car: Car) -> Car:
        """Return the car for this map: on a sloping floor with effects that hold it at rest."""
        return car if self._is_level else standing(car)

    def feel(self, fleet: Fleet, t_ns: int) -> None:
        """Write floor and wind at `t_ns` into a fleet; call it before each advance."""
        if self._sheet is not None:
            self._write(self._sheet, fleet, CLIMBS)
        if self._gusts is not None:
            fleet.air_x[:], fleet.air_y[:] = self._gusts.at(t_ns)

    def place_at_rest(self, fleet: Fleet, row: int) -> None:
        """Put a newly placed car at rest on the highest ground under its wheels."""
        if self._sheet is None:
            return
        only = np.zeros(fleet.capacity, np.bool_)
        only[row] = True
        self._write(self._sheet, fleet, rows=only)
        fleet.place_at_rest(row)

    def warm(self, fleet: Fleet) -> None:
        """Compile or load what `feel` needs before the first car drives."""
        if self._sheet is not None:
            self._write(self._sheet, fleet, rows=np.zeros(fleet.capacity, np.bool_))

    def _write(
        self, sheet: Sheet, fleet: Fleet, climbs: float = ANYTHING, rows: Bools | None = None
    ) -> None:
        """Write the floor under `rows`; steps higher than `climbs` wheel radii are ignored."""
        radius = fleet.car.value("wheel.radius_m")
        feel(
            sheet, fleet.alive if rows is None else rows,
            fleet.wheel_x, fleet.wheel_y, fleet.yaw, fleet.steer_angle, radius, climbs * radius,
            fleet.floor_height, fleet.floor_slope_x, fleet.floor_slope_y,
            fleet.floor_grip, fleet.floor_rolling,
        )  # fmt: skip


def sheet_of(floor: Floor) -> Sheet:
    """Return the arrays of a floor for the kernel."""
    pieces = pieces_of(floor)
    outlines = [() if patch.radius_m is not None else outline_of(patch) for patch in floor.patches]
    reaches = [outline_of(patch) for patch in floor.patches] + [p.corners for p in pieces]
    outlines += [piece.corners for piece in pieces]
    circles = [(p.x_m or 0.0, p.y_m or 0.0, p.radius_m or 0.0) for p in floor.patches]
    friction, heights = floor.friction_map, floor.height_map
    grey, grey_frame = np.zeros((0, 0)), np.zeros(8)
    if friction is not None and friction.samples is not None:
        grey = unpack(friction.samples) / full_scale(friction.samples)
        extent = _frame(grey, friction.x_m, friction.y_m)
        grey_frame = np.array([*extent, *friction.grip, *friction.rolling])
    hills, hills_frame = np.zeros((0, 0)), np.zeros(4)
    if heights is not None and heights.samples is not None:
        hills = (unpack(heights.samples) - heights.zero_grey) * heights.m_per_grey
        hills_frame = np.array(_frame(hills, heights.x_m, heights.y_m))
    pictures = [p for p in (friction, heights) if p is not None]
    frame, cells, starts, items, busy = _cells(
        [_bounds(reach) for reach in reaches],
        [(p.x_m[0], p.y_m[0], p.x_m[1], p.y_m[1]) for p in pictures],
    )
    return Sheet(
        frame=np.array([*frame, floor.grip, floor.rolling]),
        cells=cells,
        starts=starts,
        items=items,
        busy=busy,
        first=np.cumsum([0, *(len(outline) for outline in outlines)]),
        corners=np.array([p for outline in outlines for p in outline]).reshape(-1, 2),
        circles=np.array(circles).reshape(-1, 3),
        holds=np.array([(p.grip, p.rolling) for p in floor.patches]).reshape(-1, 2),
        planes=np.array([piece[2:] for piece in pieces]).reshape(-1, 3),
        friction=grey,
        friction_frame=grey_frame,
        heights=hills,
        level=_level(hills, hills_frame),
        height_frame=hills_frame,
    )


def _frame(
    picture: Floats, x_m: tuple[float, float], y_m: tuple[float, float]
) -> tuple[float, float, float, float]:
    rows, columns = picture.shape
    return x_m[0], y_m[0], (x_m[1] - x_m[0]) / columns, (y_m[1] - y_m[0]) / rows


def _level(heights: Floats, frame: Floats) -> Bools:
    """Return where everything within a wheel's reach has the same height."""
    lowest, highest = heights.copy(), heights.copy()
    for axis, size in ((1, frame[2]), (0, frame[3])):
        count = min(math.ceil(WHEEL_REACH_M / size) + 1, heights.shape[axis]) if size else 0
        wide = [(0, 0), (0, 0)]
        wide[axis] = (count, count)
        low, high = (np.pad(rim, wide, mode="edge") for rim in (lowest, highest))
        for k in range(2 * count + 1):
            cut = np.arange(k, k + heights.shape[axis])
            lowest = np.minimum(lowest, np.take(low, cut, axis))
            highest = np.maximum(highest, np.take(high, cut, axis))
    return np.asarray(lowest == highest)


def _bounds(points: tuple[Point, ...]) -> Bounds:
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _cells(
    shapes: list[Bounds], pictures: list[Bounds]
) -> tuple[tuple[float, float, float], Ints, Ints, Ints, Bools]:
    """Sort shapes into square cells: each into all cells of wheels that can touch it."""
    every = np.array([*shapes, *pictures]).reshape(-1, 4)
    if not len(every):
        every = np.zeros((1, 4))
    around = np.array([-1.0, -1.0, 1.0, 1.0])
    low = every[:, :2].min(axis=0) - CAR_REACH_M
    size = every[:, 2:].max(axis=0) + CAR_REACH_M - low
    cell = max(CELL_M, math.sqrt(float(np.prod(size)) / MAX_CELLS))
    columns, rows = (math.floor(length / cell) + 1 for length in size.tolist())
    corner = np.tile(low, 2)
    busy = np.zeros((rows, columns), np.bool_)
    for left, lower, right, upper in _spans(every + CAR_REACH_M * around - corner, cell):
        busy[lower : upper + 1, left : right + 1] = bool(shapes or pictures)
    found: list[list[int]] = [[] for _ in range(columns * rows)]
    here = np.array(shapes).reshape(-1, 4) + WHEEL_REACH_M * around - corner
    for i, (left, lower, right, upper) in enumerate(_spans(here, cell)):
        for row in range(lower, upper + 1):
            for column in range(left, right + 1):
                found[row * columns + column].append(i)
    starts = np.cumsum([0, *map(len, found), 0])
    items = np.array([i for held in found for i in held], dtype=np.int64)
    x, y = low.tolist()
    return (x, y, cell), np.array([columns, rows]), starts, items, np.append(busy.ravel(), False)


def _spans(bounds: Floats, cell: float) -> list[list[int]]:
    spans: list[list[int]] = np.floor(bounds / cell).astype(int).tolist()
    return spans
