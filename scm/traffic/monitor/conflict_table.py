"""The monitor's conflict table: what may never be green together, and the minimum times.

It is derived from the map by other code than the controller's program, on purpose: a mistake in
one of the two shows as a difference, not as a common blind spot. A rule that changes in `timing.py`
must therefore be changed here as well. Where the controller adds and rounds up, this table requires
only the bare minimum of a car that

    brakes at 0.5 m/s^2 from 0.267 m/s after 0.3 s                     before a yellow may end,
    drives itself, 0.30 m, out of the conflict at 0.217 m/s            before others may start,
    starts at the line after 0.3 s and is over it with all its length  before a green may end

(Nigel's figures, see its car file). A lane with a speed limit below 0.217 m/s makes clearance and
green longer; yellow always assumes 0.267 m/s, the fastest approach. The table's hash is published:
people can compare it with the one they agreed on.
"""

import hashlib
import math
from functools import cache
from itertools import combinations

import msgspec

from scm.records.city_map import CityMap, Conflict, Group, Junction, Lane, Segment, StopLine

NIGEL_TOP_MPS = 0.267
NIGEL_SLOW_MPS = 0.217
NIGEL_DECEL_MPS2 = 0.5
NIGEL_ACCEL_MPS2 = 0.5
NIGEL_LENGTH_M = 0.30
REACTION_S = 0.3

_STEP_M = 0.005  # between two places of a movement, far less than a lane is wide

# A movement: initial heading, the segments of its lane, and where its conflict begins and ends [m].
_Path = tuple[float, tuple[Segment, ...], float, float]


class GroupLimits(msgspec.Struct, kw_only=True, frozen=True):
    """The least times of one group [ns]; clearance counts from the end of its yellow."""

    name: str
    green_ns: int
    yellow_ns: int
    clearance_ns: int


class ConflictTable(msgspec.Struct, kw_only=True, frozen=True):
    """All that the monitor of one junction knows beforehand; pairs are sorted names."""

    junction: str
    groups: tuple[GroupLimits, ...]
    conflicts: tuple[tuple[str, str], ...]


def table_hash(table: ConflictTable) -> str:
    """Return twelve hexadecimal digits that change with anything in the table."""
    return hashlib.sha256(msgspec.json.encode(table)).hexdigest()[:12]


def conflict_table_of(city_map: CityMap, junction: Junction) -> ConflictTable:
    """Return the conflict table of a junction."""
    lanes = {lane.name: lane for lane in city_map.lanes}
    lines = [line for line in city_map.stop_lines if line.junction == junction.name]
    return ConflictTable(
        junction=junction.name,
        groups=tuple(_group(group, lanes, lines) for group in junction.groups),
        conflicts=tuple(
            (min(one.name, other.name), max(one.name, other.name))
            for one, other in combinations(junction.groups, 2)
            if any(_meet(a, b, lanes) for a in one.movements for b in other.movements)
        ),
    )


def _group(group: Group, lanes: dict[str, Lane], lines: list[StopLine]) -> GroupLimits:
    moves = group.movements
    slow_mps = min(NIGEL_SLOW_MPS, *(lanes[move.lane].speed_limit_mps for move in moves))
    own_lines = [line for line in lines if line.group == group.name]
    farthest_m = max(
        (_to_end_m(line, move, lanes) for line in own_lines for move in moves),
        default=max(move.to_m - move.from_m for move in moves),
    )
    braking_s = NIGEL_TOP_MPS / NIGEL_DECEL_MPS2
    starting_s = slow_mps / (2.0 * NIGEL_ACCEL_MPS2) + NIGEL_LENGTH_M / slow_mps
    return GroupLimits(
        name=group.name,
        green_ns=int((REACTION_S + starting_s) * 1e9),
        yellow_ns=int((REACTION_S + braking_s / 2.0) * 1e9),
        clearance_ns=int((farthest_m + NIGEL_LENGTH_M) / slow_mps * 1e9),
    )


def _to_end_m(line: StopLine, movement: Conflict, lanes: dict[str, Lane]) -> float:
    rest_m = 0.0 if line.lane == movement.lane else _length_m(lanes[line.lane])
    return rest_m + movement.to_m - line.at_m


def _length_m(lane: Lane) -> float:
    return sum(
        s.length_m if s.length_m is not None else (s.radius_m or 0.0) * abs(s.angle_rad or 0.0)
        for s in lane.segments
    )


def _meet(one: Conflict, other: Conflict, lanes: dict[str, Lane]) -> bool:
    """Return whether two movements come closer than a lane is wide; of one lane always."""
    if one.lane == other.lane:
        return True
    first, second = lanes[one.lane], lanes[other.lane]
    away = tuple(round(b - a, 6) for a, b in zip(first.start, second.start, strict=True))[:2]
    return _come_near(
        (first.start[2], first.segments, one.from_m, one.to_m),
        (second.start[2], second.segments, other.from_m, other.to_m),
        (away[0], away[1]),
        (first.width_m + second.width_m) / 2.0,
    )


@cache
def _come_near(one: _Path, other: _Path, away: tuple[float, float], near_m: float) -> bool:
    """Return whether two paths come near; the other starts at `away`, seen from the first's start.

    Their place on the map does not matter, so junctions of equal shape are computed once.
    """
    there = _walk(away, other)
    return any(
        math.dist(here, place) < near_m for here in _walk((0.0, 0.0), one) for place in there
    )


def _walk(start: tuple[float, float], path: _Path) -> list[tuple[float, float]]:
    """Return points along a movement, one every `_STEP_M`, by dead reckoning [m]."""
    (x, y), (yaw, segments, from_m, to_m) = start, path
    travelled_m, places = 0.0, []
    for segment in segments:
        turn_per_m = 0.0
        length_m = segment.length_m or 0.0
        if segment.radius_m is not None and segment.angle_rad is not None:
            turn_per_m = math.copysign(1.0 / segment.radius_m, segment.angle_rad)
            length_m = segment.radius_m * abs(segment.angle_rad)
        steps = max(1, round(length_m / _STEP_M))
        step_m = length_m / steps
        for _ in range(steps):
            yaw += turn_per_m * step_m / 2.0
            x, y = x + step_m * math.cos(yaw), y + step_m * math.sin(yaw)
            yaw += turn_per_m * step_m / 2.0
            travelled_m += step_m
            if from_m <= travelled_m <= to_m:
                places.append((x, y))
    return places
