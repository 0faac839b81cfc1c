"""The lanes of a map as flat arrays: what compiled drivers walk along.

A lane is a chain of straights and arcs, kept as what they are and not as points: place, heading and
the foot of a perpendicular are exact and cost the same on every map.
"""

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.geometry import Pose2
from scm.maps.polyline import advance
from scm.maps.route import Roads
from scm.records.city_map import Lane
from scm.vehicles.drivers.rules import RuleBook, Rules, cut_segments, lines_of

# Columns of a segment: where on its lane, its length, its start pose, 1/radius (+ = left), the
# lane's speed limit; and the rectangle that holds it.
AT, LENGTH, X, Y, COS, SIN, YAW, CURVATURE, LIMIT, WEST, SOUTH, EAST, NORTH = range(13)
# Columns of a stop line: where on its lane. Columns of its links: group and junction by number.
GROUP, JUNCTION = range(2)
MICRO = 1e-6


class Ways(NamedTuple):
    """The arrays; what belongs to lane i stands in rows first[i] up to first[i + 1].

    Attributes:
        length: Of each lane [m].
        segments: (n, 13), see the columns above.
        following: Lanes that begin where one ends, by number.
        line_at: Where on its lane each stop line is [m]; `line_links` its group and junction.
        stretches: (n, 2) from and to of where nobody may stop [m]; `stretch_junction` whose.
        rules: Who goes first at each line.
    """

    length: Floats
    segment_first: Ints
    segments: Floats
    next_first: Ints
    following: Ints
    line_first: Ints
    line_at: Floats
    line_links: Ints
    stretch_first: Ints
    stretches: Floats
    stretch_junction: Ints
    rules: Rules


class Streets:
    """A map's lanes for compiled drivers.

    Attributes:
        roads: Where they come from.
        names: Of the lanes, by number; `numbers` the other way round.
        goes_round: Of each lane, whether a car can drive on from it for ever.
        forbidden: (lanes, k, 2) from and to of where nobody may stop on each lane [m], NaN: none.
        ways: The arrays; of the lanes that follow one, those without end if there are any.
    """

    def __init__(self, roads: Roads) -> None:
        city_map = roads.city_map
        self.roads = roads
        self.names = tuple(lane.name for lane in city_map.lanes)
        self.numbers = {name: number for number, name in enumerate(self.names)}
        names = [junction.name for junction in city_map.junctions]
        names += [crossing.name for crossing in city_map.crossings]
        junctions = {name: n for n, name in enumerate(names)}
        segments = [_segments(roads, lane) for lane in city_map.lanes]
        segment_first = _firsts(segments)
        following = [[self.numbers[n] for n in roads.successors(name)] for name in self.names]
        self.goes_round = _endless(following)
        following = [[n for n in row if self.goes_round[n]] or row for row in following]
        lines = lines_of(roads)
        stretches = [roads.movements_on(name) for name in self.names]
        self.forbidden = np.full((len(stretches), max(map(len, stretches), default=0), 2), np.nan)
        for number, row in enumerate(stretches):
            for at, (_, move) in enumerate(row):
                self.forbidden[number, at] = move.from_m, move.to_m
        self.ways = Ways(
            length=np.array([sum(row[LENGTH] for row in rows) for rows in segments], np.float64),
            segment_first=segment_first,
            segments=_table([row for rows in segments for row in rows], 13),
            next_first=_firsts(following),
            following=np.array([n for row in following for n in row], np.int64),
            line_first=_firsts(lines),
            line_at=np.array([line.at_m for row in lines for line in row], np.float64),
            line_links=np.array(
                [(line.group, line.junction) for row in lines for line in row], np.int64
            ).reshape(-1, 2),
            stretch_first=_firsts(stretches),
            stretches=_table([(m.from_m, m.to_m) for row in stretches for _, m in row], 2),
            stretch_junction=np.array(
                [junctions[name] for row in stretches for name, _ in row], np.int64
            ),
            rules=RuleBook(roads, lines, segment_first).rules(),
        )

    def round_from(self, lane: str) -> tuple[str, ...] | None:
        """Return the one round that a car can go from a lane; None where it has a choice."""
        ways, start = self.ways, self.numbers[lane]
        at, found = start, [start]
        while ways.next_first[at + 1] - ways.next_first[at] == 1:
            at = int(ways.following[ways.next_first[at]])
            if at == start:
                return tuple(self.names[n] for n in found)
            if len(found) == len(self.names):
                return None
            found.append(at)
        return None

    def sharpest_change(self, wheelbase: float) -> float:
        """Return by how much the road wheels' angle jumps at the worst joint of the map [rad]."""
        ways = self.ways
        angle = np.arctan(wheelbase * ways.segments[:, CURVATURE])
        within = np.abs(np.diff(angle))
        within[ways.segment_first[1:-1] - 1] = 0.0
        largest = float(within.max(initial=0.0))
        lasts, firsts = angle[ways.segment_first[1:] - 1], angle[ways.segment_first[:-1]]
        before = np.repeat(np.arange(len(self.names)), np.diff(ways.next_first))
        between = np.abs(firsts[ways.following] - lasts[before])
        return max(largest, float(between.max(initial=0.0)))


def streets_of(roads: Roads) -> Streets:
    """Return the streets of these roads, made once."""
    found: Streets | None = getattr(roads, "streets", None)
    if found is None:
        found = Streets(roads)
        roads.streets = found
    return found


def _endless(following: list[list[int]]) -> list[bool]:
    """Return for each lane whether a car can drive on from it for ever."""
    before: list[list[int]] = [[] for _ in following]
    for lane, row in enumerate(following):
        for after in row:
            before[after].append(lane)
    choices = [len(row) for row in following]
    ended = [lane for lane, count in enumerate(choices) if count == 0]
    for lane in ended:  # grows while it is walked through
        for earlier in before[lane]:
            choices[earlier] -= 1
            if choices[earlier] == 0:
                ended.append(earlier)
    return [count > 0 for count in choices]


def _segments(roads: Roads, lane: Lane) -> list[tuple[float, ...]]:
    pose, at = Pose2(*lane.start), 0.0
    rows: list[tuple[float, ...]] = []
    limits = roads.limits_on(lane.name)
    for length, curvature in cut_segments(roads, lane.name):
        x, y, yaw = pose
        held = _rectangle(pose, length, curvature)
        cos, sin = math.cos(yaw), math.sin(yaw)
        limit = next(limit for begin, limit in reversed(limits) if begin <= at + MICRO)
        rows.append((at, length, x, y, cos, sin, yaw, curvature, limit, *held))
        pose, at = advance(pose, length, curvature), at + length
    return rows


def _rectangle(start: Pose2, length: float, curvature: float) -> tuple[float, ...]:
    """Return west, south, east, north of a segment, to a millimetre or so for arcs."""
    pieces = 1 + int(32.0 * abs(curvature) * length)
    places = [advance(start, length * k / pieces, curvature) for k in range(pieces + 1)]
    xs, ys = [place.x for place in places], [place.y for place in places]
    return min(xs), min(ys), max(xs), max(ys)


def _firsts(rows: Sequence[Sequence[Any]]) -> Ints:
    return np.array([0, *accumulate(len(row) for row in rows)], np.int64)


def _table(rows: Sequence[Sequence[float]], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
