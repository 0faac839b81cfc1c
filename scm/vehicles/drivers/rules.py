"""Right of way at each line of a map, as flat arrays: signs, and where paths cross.

A "way" is a path over a junction. Places along it count from its line: u < 0 before, u > 0 behind.
"""

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.geometry import Pose2, wrap_angle
from scm.maps.conflicts import meeting
from scm.maps.polyline import advance, extent
from scm.maps.route import Roads
from scm.maps.signs import Turn, precedence_at, turn_of
from scm.records.city_map import Conflict
from scm.vehicles.array_struct import ArrayStruct

# Kind of a line: with a signal, a stop sign, a give-way sign, or none (right before left).
LIT, STOP_SIGN, GIVE_WAY, PLAIN = range(4)

LOOK_BACK_S = 8.0  # driving time before a line within which other cars matter
MIN_BACK_M = 1.5
MAX_BACK_M = 6.0
BEYOND_M = 0.2  # behind a junction that still belongs to a way
MAX_LANES = 3  # between a line and the lane that crosses the junction
TOLERANCE_M = 0.04  # a conflict may begin this far before its line
ACROSS_RAD = math.radians(45.0)  # lines at a larger angle come from the side
_SIGNED = {"stop": STOP_SIGN, "give_way": GIVE_WAY, None: PLAIN}


class Rules(ArrayStruct):
    """The arrays: n lines in the order of `LaneArrays`, w ways over junctions, p pairs of ways.

    Attributes:
        kind: (n,) kind of each line, see above.
        order: (n,) its place among the lines of its junction.
        all_stop: (n,) whether all lines of its junction have a stop sign.
        limit: (n,) speed limit at the line [m/s].
        window: (n, 4) left, low, right, high of the area that matters at its junction [m].
        peer_first: (n + 1,) start of each line's `peers`: the other lines of its junction.
        feed_first: (n + 1,) start of each line's approach segments; `feed_begin` is their place.
        way_first: (n + 1,) start of each line's ways.
        way_lane: (w,) the way's lane in the junction, `way_depth` lanes after the line.
        path_first: (w + 1,) start of each way's segments; `path_begin` is their place.
        pair_first: (w + 1,) start of each way's conflicting ways: `pair_way`.
        pair_yields: (p,) whether the way gives way to the other one.
        zones: (p, 4) from and to of the conflict zone, on the way and on the other one.
    """

    kind: Ints
    order: Ints
    all_stop: Bools
    limit: Floats
    window: Floats
    peer_first: Ints
    peers: Ints
    feed_first: Ints
    feeds: Ints
    feed_begin: Floats
    way_first: Ints
    way_lane: Ints
    way_depth: Ints
    path_first: Ints
    paths: Ints
    path_begin: Floats
    pair_first: Ints
    pair_way: Ints
    pair_yields: Bools
    zones: Floats


class Line(NamedTuple):
    """A line at which cars wait.

    Attributes:
        junction: Number over the junctions with signals, then the crossings without.
        group: Number over all signal groups; -1: no signals.
        ways: Of its group or its approach.
    """

    lane: str
    at_m: float
    junction: int
    group: int
    kind: int
    ways: tuple[Conflict, ...]


class _Way(NamedTuple):
    line: int
    lanes: tuple[str, ...]
    move: Conflict
    begin: float
    turn: Turn


def lines_of(roads: Roads) -> list[list[Line]]:
    """Return the lines of each lane of a map, in driving order."""
    city_map = roads.city_map
    junctions = {junction.name: n for n, junction in enumerate(city_map.junctions)}
    crossings = {c.name: len(junctions) + n for n, c in enumerate(city_map.crossings)}
    groups: dict[tuple[str, str], tuple[int, tuple[Conflict, ...]]] = {}
    for junction in city_map.junctions:
        for group in junction.groups:
            groups[junction.name, group.name] = len(groups), group.movements
    found = []
    for lane in city_map.lanes:
        lines = []
        for stop in roads.stop_lines_on(lane.name):
            number, ways = groups[stop.junction, stop.group]
            lines.append(Line(lane.name, stop.at_m, junctions[stop.junction], number, LIT, ways))
        for name, approach in roads.approaches_on(lane.name):
            kind = _SIGNED[precedence_at(roads.signs.get(lane.name, ()), approach.at_m)]
            at_m, ways = approach.at_m, approach.ways
            lines.append(Line(lane.name, at_m, crossings[name], -1, kind, ways))
        found.append(sorted(lines, key=lambda line: line.at_m))
    return found


class RuleBook:
    """Builds the rules of one map.

    Args:
        roads: Its lanes.
        lines: From `lines_of`.
        segment_first: First segment of each lane.
    """

    def __init__(self, roads: Roads, lines: list[list[Line]], segment_first: Ints) -> None:
        self._roads = roads
        self._lines = [line for row in lines for line in row]
        names = [lane.name for lane in roads.city_map.lanes]
        self._numbers = {name: number for number, name in enumerate(names)}
        self._segment_first = segment_first
        self._before: dict[str, list[str]] = {}
        for name in names:
            for after in roads.successors(name):
                self._before.setdefault(after, []).append(name)
        self._back = min(MAX_BACK_M, max(MIN_BACK_M, LOOK_BACK_S * self._fastest()))
        self._members: dict[int, list[int]] = {}
        for number, line in enumerate(self._lines):
            self._members.setdefault(line.junction, []).append(number)
        self._ways = [
            way for number, line in enumerate(self._lines) for way in self._ways_from(number, line)
        ]

    def rules(self) -> Rules:
        """Return the arrays."""
        lines, ways = self._lines, self._ways
        order = {n: k for row in self._members.values() for k, n in enumerate(row)}
        peers = [
            [p for p in self._members[line.junction] if p != n] for n, line in enumerate(lines)
        ]
        feeds = [self._feed(line) for line in lines]
        paths = [self._path(way) for way in ways]
        of_line: list[list[int]] = [[] for _ in lines]
        for number, way in enumerate(ways):
            of_line[way.line].append(number)
        pairs = [self._pairs(way, peers, of_line, order) for way in ways]
        stop = {
            junction: len(row) > 1 and all(lines[n].kind == STOP_SIGN for n in row)
            for junction, row in self._members.items()
        }
        return Rules(
            kind=np.array([line.kind for line in lines], np.int64),
            order=np.array([order[n] for n in range(len(lines))], np.int64),
            all_stop=np.array([stop[line.junction] for line in lines], np.bool_),
            limit=np.array([self._limit_at(line) for line in lines], np.float64),
            window=_floats(self._windows(), 4),
            peer_first=_firsts(peers),
            peers=_ints(peers),
            feed_first=_firsts(feeds),
            feeds=np.array([number for row in feeds for number, _ in row], np.int64),
            feed_begin=np.array([begin for row in feeds for _, begin in row], np.float64),
            way_first=_firsts(of_line),
            way_lane=np.array([self._numbers[way.move.lane] for way in ways], np.int64),
            way_depth=np.array([len(way.lanes) - 1 for way in ways], np.int64),
            path_first=_firsts(paths),
            paths=np.array([number for row in paths for number, _ in row], np.int64),
            path_begin=np.array([begin for row in paths for _, begin in row], np.float64),
            pair_first=_firsts(pairs),
            pair_way=np.array([pair[0] for row in pairs for pair in row], np.int64),
            pair_yields=np.array([pair[1] for row in pairs for pair in row], np.bool_),
            zones=_floats([pair[2] for row in pairs for pair in row], 4),
        )

    def _fastest(self) -> float:
        return max((lane.speed_limit_mps for lane in self._roads.city_map.lanes), default=0.0)

    def _limit_at(self, line: Line) -> float:
        limits = self._roads.limits_on(line.lane)
        return next(limit for at, limit in reversed(limits) if at <= line.at_m)

    def _ways_from(self, number: int, line: Line) -> list[_Way]:
        """Return the ways from a line, over at most MAX_LANES lanes."""
        wanted: dict[str, list[Conflict]] = {}
        for move in line.ways:
            wanted.setdefault(move.lane, []).append(move)
        found: list[_Way] = []
        chains: list[tuple[tuple[str, ...], float]] = [((line.lane,), -line.at_m)]
        for _ in range(MAX_LANES + 1):
            longer: list[tuple[tuple[str, ...], float]] = []
            for chain, begin in chains:
                lane, least = chain[-1], line.at_m - TOLERANCE_M if len(chain) == 1 else 0.0
                for move in wanted.get(lane, ()):
                    if move.from_m >= least:
                        turn = turn_of(self._roads.definition(lane))
                        found.append(_Way(number, chain, move, begin, turn))
                after = begin + self._roads.length_of(lane)
                longer += [((*chain, name), after) for name in self._roads.successors(lane)]
            chains = longer
        return found

    def _path(self, way: _Way) -> list[tuple[int, float]]:
        """Return the segments from a line to BEYOND_M behind its junction."""
        roads, rows = self._roads, []
        end = way.begin + way.move.to_m + BEYOND_M
        begin = way.begin - sum(roads.length_of(name) for name in way.lanes[:-1])
        lanes = list(way.lanes)
        while lanes:
            lane = lanes.pop(0)
            for number, at, length in self._segments(lane):
                if begin + at + length > 0.0 and begin + at < end:
                    rows.append((number, begin + at))
            begin += roads.length_of(lane)
            following = roads.successors(lane)
            if not lanes and begin < end and len(following) == 1:
                lanes.append(following[0])
        return rows

    def _feed(self, line: Line) -> list[tuple[int, float]]:
        """Return all segments that lead to a line."""
        rows, open_ = [], [(line.lane, -line.at_m)]
        while open_:
            lane, begin = open_.pop()
            for number, at, length in self._segments(lane):
                if begin + at < 0.0 and begin + at + length > -self._back:
                    rows.append((number, begin + at))
            if begin > -self._back:
                before = self._before.get(lane, ())
                open_ += [(name, begin - self._roads.length_of(name)) for name in before]
        return rows

    def _segments(self, lane: str) -> list[tuple[int, float, float]]:
        """Return number, place on the lane, and length of a lane's segments."""
        first = int(self._segment_first[self._numbers[lane]])
        lengths = [length for length, _ in cut_segments(self._roads, lane)]
        starts = accumulate(lengths, initial=0.0)
        pieces = zip(lengths, starts, strict=False)  # the last start is the lane's end
        return [(first + k, at, length) for k, (length, at) in enumerate(pieces)]

    def _pairs(
        self, way: _Way, peers: list[list[int]], of_line: list[list[int]], order: dict[int, int]
    ) -> list[tuple[int, bool, tuple[float, ...]]]:
        """Return a way's conflicts: the other way, whether it has right of way, and the zone."""
        rows: list[tuple[int, bool, tuple[float, ...]]] = []
        for peer in peers[way.line]:
            for number in of_line[peer]:
                other = self._ways[number]
                met = meeting(way.move, other.move, self._roads)
                if met is None:
                    continue
                zone = (
                    way.begin + met.from_m,
                    way.begin + met.to_m,
                    other.begin + met.other_from_m,
                    other.begin + met.other_to_m,
                )
                rows.append((number, self._yields(way, other, order), zone))
        return rows

    def _yields(self, way: _Way, other: _Way, order: dict[int, int]) -> bool:
        """Return whether a way gives way: by signs, else right before left, left turns last.

        Mirrored where cars drive on the left.
        """
        mine, theirs = self._lines[way.line], self._lines[other.line]
        is_major, other_is_major = mine.kind in (LIT, PLAIN), theirs.kind in (LIT, PLAIN)
        if is_major != other_is_major:
            return other_is_major
        angle = wrap_angle(self._pose(theirs).yaw - self._pose(mine).yaw)
        on_left = self._roads.city_map.drives_on == "left"
        if ACROSS_RAD <= abs(angle) <= math.pi - ACROSS_RAD:
            return (angle > 0.0) != on_left
        across = "right" if on_left else "left"
        turns_across, other_turns_across = way.turn == across, other.turn == across
        if abs(angle) > ACROSS_RAD and turns_across != other_turns_across:
            return turns_across
        return order[way.line] > order[other.line]

    def _pose(self, line: Line) -> Pose2:
        """Return a line's place and its lane's heading there."""
        pose, left = Pose2(*self._roads.definition(line.lane).start), line.at_m
        for segment in self._roads.definition(line.lane).segments:
            length, curvature = extent(segment)
            pose = advance(pose, min(length, left), curvature)
            left -= length
            if left <= 0.0:
                break
        return pose

    def _windows(self) -> list[tuple[float, ...]]:
        """Return the area around each line in which other cars matter."""
        boxes = {}
        for junction, row in self._members.items():
            xs, ys = zip(
                *((p.x, p.y) for p in (self._pose(self._lines[n]) for n in row)), strict=True
            )
            back = self._back
            boxes[junction] = min(xs) - back, min(ys) - back, max(xs) + back, max(ys) + back
        return [boxes[line.junction] for line in self._lines]


def cut_segments(roads: Roads, lane: str) -> list[tuple[float, float]]:
    """Return length and curvature of a lane's segments, split where a speed limit begins."""
    cuts = [at for at, _ in roads.limits_on(lane)]
    rows, begin = [], 0.0
    for segment in roads.definition(lane).segments:
        length, curvature = extent(segment)
        inside = [at for at in cuts if begin < at < begin + length]
        ends = [*inside, begin + length]
        for start, end in zip([begin, *inside], ends, strict=True):
            rows.append((end - start, curvature))
        begin += length
    return rows


def _firsts(rows: Sequence[Sequence[Any]]) -> Ints:
    return np.array([0, *accumulate(len(row) for row in rows)], np.int64)


def _ints(rows: Sequence[Sequence[int]]) -> Ints:
    return np.array([value for row in rows for value in row], np.int64)


def _floats(rows: Sequence[Sequence[float]], columns: int) -> Floats:
    return np.array(rows, np.float64).reshape(-1, columns)
