"""The lane graph of a map as flat arrays for compiled drivers.

A lane is a chain of straights and arcs, stored as such and not as points: place, heading and
projections are exact and cost the same on every map.
"""

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.geometry import Pose2
from scm.maps.border import BEYOND
from scm.maps.polyline import advance
from scm.maps.route import Roads
from scm.records.city_map import Lane
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.drivers.rules import RuleBook, Rules, cut_segments, lines_of

# Columns of a segment: place on its lane, length, start pose, curvature (+ = left), speed limit,
# and bounding box.
AT, LENGTH, X, Y, COS, SIN, YAW, CURVATURE, LIMIT, WEST, SOUTH, EAST, NORTH = range(13)
# Columns of a stop line's links: signal group and junction by number.
GROUP, JUNCTION = range(2)
TOLERANCE_M = 1e-6


class LaneArrays(ArrayStruct):
    """The arrays; rows first[i] to first[i + 1] belong to lane i.

    Attributes:
        length: Of each lane [m].
        segments: (n, 13), see the columns above.
        following: Successors of each lane, by number.
        line_at: Place of each stop line on its lane [m]; `line_links` its group and junction.
        stretches: (n, 2) from and to of where stopping is forbidden [m]; `stretch_junction` whose.
        rules: Right of way at each line.
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


class LaneGraph:
    """The lane graph of one map.

    Attributes:
        roads: The map's roads.
        names: Of the lanes, by number; `numbers` is the inverse.
        goes_round: Whether a car can drive on for ever from each lane.
        forbidden: (lanes, k, 2) from and to of where stopping is forbidden [m]; NaN: none.
        arrays: For compiled code; dead-end successors are left out where there are others.
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
        self.arrays = LaneArrays(
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
        """Return the only loop from a lane, or None where a car has a choice."""
        arrays, start = self.arrays, self.numbers[lane]
        at, found = start, [start]
        while arrays.next_first[at + 1] - arrays.next_first[at] == 1:
            at = int(arrays.following[arrays.next_first[at]])
            if at == start:
                return tuple(self.names[n] for n in found)
            if len(found) == len(self.names):
                return None
            found.append(at)
        return None

    def beyond(self, lane: int) -> list[int]:
        """Return what lies beyond the border at the end of a lane, if it leads out of the city."""
        return [self.numbers[n] for n in self.roads.successors(self.names[lane]) if n[-1] == BEYOND]

    def sharpest_change(self, wheelbase: float) -> float:
        """Return the largest jump of the steering angle between segments of the map [rad]."""
        arrays = self.arrays
        angle = np.arctan(wheelbase * arrays.segments[:, CURVATURE])
        within = np.abs(np.diff(angle))
        within[arrays.segment_first[1:-1] - 1] = 0.0
        largest = float(within.max(initial=0.0))
        lasts, firsts = angle[arrays.segment_first[1:] - 1], angle[arrays.segment_first[:-1]]
        before = np.repeat(np.arange(len(self.names)), np.diff(arrays.next_first))
        between = np.abs(firsts[arrays.following] - lasts[before])
        return max(largest, float(between.max(initial=0.0)))


def lane_graph_of(roads: Roads) -> LaneGraph:
    """Return the lane graph of these roads, built once."""
    found: LaneGraph | None = getattr(roads, "lane_graph", None)
    if found is None:
        found = LaneGraph(roads)
        roads.lane_graph = found
    return found


def _endless(following: list[list[int]]) -> list[bool]:
    """Return for each lane whether a car can drive on for ever."""
    before: list[list[int]] = [[] for _ in following]
    for lane, row in enumerate(following):
        for after in row:
            before[after].append(lane)
    choices = [len(row) for row in following]
    ended = [lane for lane, count in enumerate(choices) if count == 0]
    for lane in ended:  # grows during the loop
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
        box = _rectangle(pose, length, curvature)
        cos, sin = math.cos(yaw), math.sin(yaw)
        limit = next(limit for begin, limit in reversed(limits) if begin <= at + TOLERANCE_M)
        rows.append((at, length, x, y, cos, sin, yaw, curvature, limit, *box))
        pose, at = advance(pose, length, curvature), at + length
    return rows


def _rectangle(start: Pose2, length: float, curvature: float) -> tuple[float, ...]:
    """Return west, south, east, north of a segment; accurate to about a millimetre for arcs."""
    pieces = 1 + int(32.0 * abs(curvature) * length)
    places = [advance(start, length * k / pieces, curvature) for k in range(pieces + 1)]
    xs, ys = [place.x for place in places], [place.y for place in places]
    return min(xs), min(ys), max(xs), max(ys)


def _firsts(rows: Sequence[Sequence[Any]]) -> Ints:
    return np.array([0, *accumulate(len(row) for row in rows)], np.int64)


def _table(rows: Sequence[Sequence[float]], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
