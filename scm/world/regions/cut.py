"""Cut a map into regions of equal traffic, in the middle of roads.

    unit      a junction with all that is nearer to it along the lanes than to any other junction;
              on a map without junctions, a piece of a lane
    weight    of a unit: cars that are there in steady traffic, flow * length / speed limit;
              of the border of two units: cars that cross it
    flow      of a lane: cars that take every branch equally often

Units are divided by METIS where `pymetis` is installed (extra `regions`), else by recursive
bisection along the longer side. Either way a junction is in one region with all its lanes, and
every place of the floor belongs to the region of the nearest lane.
Source: Karypis, Kumar, A fast and high quality multilevel scheme for partitioning irregular graphs,
1998; Berger, Bokhari, A partitioning strategy for nonuniform problems, 1987 (bisection).
"""

import heapq
import importlib
import math
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats, Ints
from scm.errors import MapError
from scm.maps.route import Roads, roads_of
from scm.records.city_map import CityMap

STEP_M = 0.25  # between two samples of a lane
PIECE = 8  # samples of a unit on a map without junctions
CELL_M = 0.25
MAX_CELLS = 4_000_000  # larger ones on a larger map
ROUNDS = 200  # of the flow, until it is steady
BAND_M = 2.0  # beside a cut, where cars of two regions may touch
SCALE = 1000  # METIS wants whole numbers
MAX_REGIONS = 64
NONE = -1


Regions = NDArray[np.int8]


class Units(NamedTuple):
    """What is never cut.

    Attributes:
        of: (k,) unit of each sample of the lanes.
        x, y: (k,) where the samples are [m].
        weights: (u,) cars in each unit, in steady traffic.
        borders: Cars that cross from one unit to another, by pair of them, the lower first.
    """

    of: Ints
    x: Floats
    y: Floats
    weights: Floats
    borders: dict[tuple[int, int], float]


class Cut:
    """The regions of a map.

    Attributes:
        regions: How many.
        frame: x and y of the lower left of the cells, and their edge [m].
        cells: (rows, columns) region of each place; small numbers, since many are looked up.
        near: (rows, columns) whether another region is within `BAND_M`.
    """

    def __init__(self, regions: int, frame: Floats, cells: Ints) -> None:
        self.regions, self.frame = regions, frame
        self.cells: Regions = np.ascontiguousarray(cells.astype(np.int8))
        reach = math.ceil(BAND_M / float(frame[2]))
        around = [_spread(cells == number, reach) for number in range(regions)]
        self.near: Bools = np.sum(around, axis=0) > 1

    def region_of(self, x: float, y: float) -> int:
        """Return the region of a place; beyond the floor, that of the nearest place on it."""
        left, low, edge = self.frame.tolist()
        rows, columns = self.cells.shape
        row = min(max(math.floor((y - low) / edge), 0), rows - 1)
        column = min(max(math.floor((x - left) / edge), 0), columns - 1)
        return int(self.cells[row, column])

    def within(self, number: int, reach_m: float) -> Bools:
        """Return which cells lie in a region, or not farther from it than a distance."""
        return _spread(self.cells == number, math.ceil(reach_m / float(self.frame[2])))


def cut_map(city_map: CityMap, regions: int, *, by: str | None = None) -> Cut:
    """Cut a map.

    Args:
        city_map: The map; movable boxes are not known to regions yet.
        regions: How many.
        by: `metis` or `bisection`; None: METIS where it is installed.

    Raises:
        MapError: The map cannot be cut into so many regions.
    """
    if not 1 <= regions <= MAX_REGIONS:
        raise MapError(f"regions: got {regions}, expected 1 to {MAX_REGIONS}")
    if regions > 1 and any(box.mass_kg is not None for box in city_map.boxes):
        msg = f"map {city_map.name}: expected no boxes that cars can push where a city is cut"
        raise MapError(msg)
    if regions > 1 and city_map.neighbours:
        msg = f"map {city_map.name}: expected no [[neighbours]] where a city is cut"
        raise MapError(msg)
    units = units_of(roads_of(city_map))
    if len(units.weights) < regions:
        found = f"{len(units.weights)} places where it can be cut"
        raise MapError(f"map {city_map.name}: {regions} regions, but {found}")
    by = by or ("metis" if find_spec("pymetis") else "bisection")
    parts = (_by_metis if by == "metis" else _by_bisection)(units, regions)
    return Cut(regions, *_cells(city_map, units, parts[units.of]))


def shares(units: Units, parts: Ints, regions: int) -> Floats:
    """Return the share of all cars that are in each region, in steady traffic."""
    cars = np.bincount(parts, units.weights, regions)
    return np.asarray(cars / cars.sum())


def units_of(roads: Roads) -> Units:
    """Return the units of a map."""
    names = list(roads.lanes)
    flow = _flow(roads, names)
    first = dict[str, int]()
    places, lane_of = list[tuple[float, float]](), list[int]()
    for number, name in enumerate(names):
        first[name] = len(places)
        length = roads.length_of(name)
        for k in range(max(1, math.ceil(length / STEP_M))):
            pose = roads.lanes[name].at(min(length, (k + 0.5) * STEP_M))
            places.append((pose.x, pose.y))
            lane_of.append(number)
    lanes = np.array(lane_of, np.int64)
    links = [(i, i + 1) for i in range(len(lanes) - 1) if lanes[i] == lanes[i + 1]]
    last = {name: first[name] + int((lanes == n).sum()) - 1 for n, name in enumerate(names)}
    links += [(last[name], first[after]) for name in names for after in roads.successors(name)]
    of = _nearest_junction(roads, first, len(lanes), links)
    alone = of == NONE
    pieces = np.cumsum(np.arange(len(of)) % PIECE == 0)
    numbers = np.where(alone, of.max(initial=NONE) + pieces, of)
    _, of = np.unique(numbers, return_inverse=True)
    speeds = np.array([roads.definition(name).speed_limit_mps for name in names])
    weights = np.bincount(of, (flow / speeds)[lanes] * STEP_M).astype(np.float64)
    borders = dict[tuple[int, int], float]()
    for a, b in links:
        if of[a] != of[b]:
            pair = (min(int(of[a]), int(of[b])), max(int(of[a]), int(of[b])))
            borders[pair] = borders.get(pair, 0.0) + float(flow[lanes[b]])
    x, y = np.array(places).reshape(-1, 2).T
    return Units(of, x, y, weights, borders)


def _flow(roads: Roads, names: Sequence[str]) -> Floats:
    """Return how many cars pass through each lane, of as many as there are lanes."""
    number = {name: i for i, name in enumerate(names)}
    links = [(i, number[after]) for i, name in enumerate(names) for after in roads.successors(name)]
    begin, end = np.array(links, np.int64).reshape(-1, 2).T
    branches = np.bincount(begin, minlength=len(names))
    flow: Floats = np.ones(len(names))
    for _ in range(ROUNDS):
        onward = np.bincount(end, flow[begin] / branches[begin], len(names))
        # half stays: cars that go round in step would never become steady; dead ends start anew
        lost = float(flow[branches == 0].sum()) / len(names)
        flow = 0.5 * (flow * (branches > 0) + onward) + 0.5 * lost + 1e-9
        flow *= len(names) / flow.sum()
    return flow


def _nearest_junction(
    roads: Roads, first: dict[str, int], count: int, links: Sequence[tuple[int, int]]
) -> Ints:
    """Return the junction of each sample, nearest along the lanes; -1: none can be reached."""
    beside: list[list[int]] = [[] for _ in range(count)]
    for a, b in links:
        beside[a].append(b)
        beside[b].append(a)
    of: Ints = np.full(count, NONE, np.int64)
    waiting: list[tuple[int, int, int]] = []
    city_map = roads.city_map
    ways = [[m for group in one.groups for m in group.movements] for one in city_map.junctions]
    ways += [[way for one in each.approaches for way in one.ways] for each in city_map.crossings]
    for junction, stretches in enumerate(ways):
        for stretch in stretches:
            begin = max(0, math.floor(stretch.from_m / STEP_M))
            end = max(begin + 1, math.ceil(stretch.to_m / STEP_M))
            most = max(1, math.ceil(roads.length_of(stretch.lane) / STEP_M))
            for k in range(min(begin, most - 1), min(end, most)):
                heapq.heappush(waiting, (0, junction, first[stretch.lane] + k))
    while waiting:
        steps, junction, sample = heapq.heappop(waiting)
        if of[sample] != NONE:
            continue
        of[sample] = junction
        for other in beside[sample]:
            if of[other] == NONE:
                heapq.heappush(waiting, (steps + 1, junction, other))
    return of


def _by_metis(units: Units, regions: int) -> Ints:
    if regions == 1:
        return np.zeros(len(units.weights), np.int64)
    beside: list[list[tuple[int, float]]] = [[] for _ in units.weights]
    for (a, b), cars in sorted(units.borders.items()):
        beside[a].append((b, cars))
        beside[b].append((a, cars))
    pymetis: Any = importlib.import_module("pymetis")
    starts = np.cumsum([0, *map(len, beside)]).tolist()
    adjacent = [other for row in beside for other, _ in row]
    _, parts = pymetis.part_graph(
        regions,
        pymetis.CSRAdjacency(adj_starts=starts, adjacent=adjacent),
        vweights=_whole(units.weights),
        eweights=_whole(np.array([cars for row in beside for _, cars in row])),
        recursive=regions <= 8,  # METIS's own advice: bisection is better for few parts
    )
    return np.array(parts, np.int64)


def _whole(weights: Floats) -> list[int]:
    largest = float(weights.max(initial=1e-9))
    scaled: list[int] = np.maximum(1, np.rint(weights * (SCALE / largest))).astype(int).tolist()
    return scaled


def _by_bisection(units: Units, regions: int) -> Ints:
    count = np.bincount(units.of)
    x, y = np.bincount(units.of, units.x) / count, np.bincount(units.of, units.y) / count
    parts: Ints = np.zeros(len(count), np.int64)
    _bisect(parts, np.arange(len(count)), x, y, units.weights, 0, regions)
    return parts


def _bisect(
    parts: Ints, of: Ints, x: Floats, y: Floats, weights: Floats, first: int, regions: int
) -> None:
    """Give the units `of` the numbers from `first` on, each region a like share."""
    if regions == 1:
        parts[of] = first
        return
    lower = regions // 2
    spread = [float(np.ptp(v[of])) if len(of) else 0.0 for v in (x, y)]
    along = (x, y)[int(spread[1] > spread[0])]
    order = of[np.argsort(along[of], kind="stable")]
    part = np.cumsum(weights[order]) / weights[order].sum()
    at = int(np.searchsorted(part, lower / regions)) + 1
    at = min(max(at, lower), len(order) - (regions - lower))
    _bisect(parts, order[:at], x, y, weights, first, lower)
    _bisect(parts, order[at:], x, y, weights, first + lower, regions - lower)


def _cells(city_map: CityMap, units: Units, regions: Ints) -> tuple[Floats, Ints]:
    """Return the frame of the cells and the region of each: that of the nearest sample."""
    (left, right), (low, high) = city_map.floor.x_m, city_map.floor.y_m
    edge = max(CELL_M, math.sqrt((right - left) * (high - low) / MAX_CELLS))
    columns, rows = (max(1, math.ceil(span / edge)) for span in (right - left, high - low))
    cells: Ints = np.full((rows, columns), NONE, np.int64)
    column = np.clip(((units.x - left) / edge).astype(int), 0, columns - 1)
    row = np.clip(((units.y - low) / edge).astype(int), 0, rows - 1)
    cells[row, column] = regions
    while (empty := cells == NONE).any():
        for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
            beside = np.roll(cells, way, axis)
            edge_row = [slice(None)] * 2
            edge_row[axis] = slice(0, 1) if way == 1 else slice(-1, None)
            beside[tuple(edge_row)] = NONE
            fill = empty & (cells == NONE) & (beside != NONE)
            cells[fill] = beside[fill]
    return np.array([left, low, edge]), cells


def _spread(mask: Bools, reach: int) -> Bools:
    """Return which cells have one of a mask within a square about them."""
    for axis in (0, 1):
        wide = [(0, 0), (0, 0)]
        wide[axis] = (reach + 1, reach)
        total = np.cumsum(np.pad(mask.astype(np.int64), wide), axis=axis)
        size = mask.shape[axis]
        upper = np.take(total, np.arange(2 * reach + 1, 2 * reach + 1 + size), axis)
        mask = upper - np.take(total, np.arange(size), axis) > 0
    return mask
