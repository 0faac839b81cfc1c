"""Whether cars on two lanes of an imported city would touch, where nothing rules them.

The sides of a Nigel that drives along one lane must keep half a car and 12 mm from the middle of
the other lane, as far as cars stand there. Front corners leave bends: at a radius of 0.38 m they
swing 54 mm wide.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats
from scm.geometry import Pose2
from scm.maps.conflicts import meeting
from scm.maps.route import Roads
from scm.maps.sumo_curves import Curve, Dots, dotted, turned
from scm.records.city_map import CityMap, Conflict

HALF_WIDTH_M = 0.0875  # of a Nigel
FRONT_M = 0.23  # before its rear axle
STRAY_M = 0.012  # drivers stray 8 mm from the middle of a bend of 0.38 m
CLEAR_M = HALF_WIDTH_M + STRAY_M
SHORT_M = 0.2  # a way over a junction that does not part what is before and behind it
CELL_M = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """What cars on a lane cover, (n, 2): where their sides go, where their middle may stand.

    `least` and `most` are the corners of a box around the sides.
    """

    sides: Floats
    middle: Floats
    least: tuple[float, float]
    most: tuple[float, float]


class Close(NamedTuple):
    """Two lanes on which cars would touch, how much is left between them, and where [m]."""

    lane: str
    other: str
    gap_m: float
    x_m: float
    y_m: float


def strip_of(dots: Dots, *, stand: Bools | None = None) -> Strip:
    """Return what cars cover whose rear axle goes along places; they stand where `stand` says."""
    points = ((FRONT_M, HALF_WIDTH_M), (FRONT_M, -HALF_WIDTH_M), (0.0, HALF_WIDTH_M),
              (0.0, -HALF_WIDTH_M))  # fmt: skip
    sides = [dots.points + turned(np.full_like(dots.points, at), dots.yaw) for at in points]
    covered = np.concatenate(sides)
    (x, y), (far_x, far_y) = covered.min(axis=0).tolist(), covered.max(axis=0).tolist()
    middle = dots.points if stand is None else dots.points[stand]
    return Strip(covered, middle, (x, y), (far_x, far_y))


def is_clear(one: Strip, other: Strip, least_m: float = STRAY_M) -> bool:
    """Return whether cars on two lanes keep clear of each other, by so much or more."""
    apart_m = max(
        one.least[0] - other.most[0],
        one.least[1] - other.most[1],
        other.least[0] - one.most[0],
        other.least[1] - one.most[1],
    )
    return apart_m >= least_m or gap(one, other)[0] >= least_m


def gap(one: Strip, other: Strip) -> tuple[float, Floats]:
    """Return what is left between cars on two lanes [m], negative: they overlap; and where."""
    return min(_reach(one.sides, other.middle), _reach(other.sides, one.middle), key=itemgetter(0))


def apart_m(one: Floats, other: Floats) -> float:
    """Return how close two lines of points come, both (n, 2)."""
    return math.sqrt(float(_squared(one, other).min()))


def _squared(one: Floats, other: Floats) -> Floats:
    a, b = one - one[0], other - one[0]
    squared = (a * a).sum(axis=1)[:, None] + (b * b).sum(axis=1) - 2.0 * (a @ b.T)
    positive: Floats = np.maximum(squared, 0.0)
    return positive


def _reach(sides: Floats, middle: Floats) -> tuple[float, Floats]:
    if not len(middle):
        return math.inf, sides[0]
    nearest = _squared(sides, middle).min(axis=1)
    at = int(nearest.argmin())
    return math.sqrt(nearest[at]) - HALF_WIDTH_M, sides[at]


def unruled(city_map: CityMap) -> list[Close]:
    """Return the pairs of lanes on which cars would touch, though no signal or sign rules them."""
    roads = Roads(city_map)
    strips = {lane.name: _strip(lane.name, roads) for lane in city_map.lanes}
    followed, movements = _followed(roads), _movements(city_map)
    found = []
    for lane, other in _neighbours(strips):
        if frozenset((lane, other)) in followed or is_clear(strips[lane], strips[other]):
            continue
        if not _are_ruled(movements.get(lane), movements.get(other), roads):
            left_m, at = gap(strips[lane], strips[other])
            found.append(Close(lane, other, left_m, *at.tolist()))
    return found


def _strip(lane: str, roads: Roads) -> Strip:
    """Return what cars cover on a lane; they stand no farther than its line, if it has one."""
    definition = roads.definition(lane)
    dots = dotted(Curve(Pose2(*definition.start), definition.segments))
    lines = [line.at_m for line in roads.stop_lines_on(lane)]
    lines += [approach.at_m for _, approach in roads.approaches_on(lane)]
    return strip_of(dots, stand=dots.at_m <= max(lines, default=math.inf))


def _followed(roads: Roads) -> set[frozenset[str]]:
    """Return the pairs of lanes of which one follows the other, or both the same one."""
    pairs: set[frozenset[str]] = set()
    for lane in roads.city_map.lanes:
        pairs |= {frozenset((lane.name, name)) for name in lane.next}
        pairs |= {frozenset(pair) for pair in product(lane.next, lane.next)}
        short = [name for name in lane.next if roads.length_of(name) < SHORT_M]
        pairs |= {frozenset((lane.name, b)) for name in short for b in roads.successors(name)}
    return pairs


def _movements(city_map: CityMap) -> dict[str, tuple[str, Conflict]]:
    """Return the junction or crossing, and the stretch, of each lane over one."""
    found: dict[str, tuple[str, Conflict]] = {}
    for junction in city_map.junctions:
        moves = (move for group in junction.groups for move in group.movements)
        found |= {move.lane: (junction.name, move) for move in moves}
    for crossing in city_map.crossings:
        ways = (way for approach in crossing.approaches for way in approach.ways)
        found |= {way.lane: (crossing.name, way) for way in ways}
    return found


def _are_ruled(
    one: tuple[str, Conflict] | None, other: tuple[str, Conflict] | None, roads: Roads
) -> bool:
    if one is None or other is None or one[0] != other[0]:
        return False
    return meeting(one[1], other[1], roads) is not None


def _neighbours(strips: Mapping[str, Strip]) -> Iterable[tuple[str, str]]:
    """Return the pairs of lanes of which one comes into the other's cells of the floor."""
    cells: dict[tuple[int, int], list[str]] = defaultdict(list)
    for name, strip in strips.items():
        berth = (-CLEAR_M, CLEAR_M)
        reach = np.concatenate([strip.sides + step for step in product(berth, berth)])
        for x, y in np.unique(np.floor(reach / CELL_M).astype(int), axis=0).tolist():
            cells[x, y].append(name)
    pairs = {
        (one, other)
        for names in cells.values()
        for k, one in enumerate(names)
        for other in names[k + 1 :]
    }
    return sorted(pairs)
