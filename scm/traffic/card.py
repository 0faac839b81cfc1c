"""The monitor's program card: what may never be green together, and the least times it accepts.

It is derived from the map a second time and by other code than the controller's program, on
purpose: a mistake in one of the two shows as a difference, not as a common blind spot. Where the
controller adds and rounds up, the card asks for the bare minimum of a car that

    brakes at 0.5 m/s^2 from 0.267 m/s after 0.3 s                     before a yellow may end,
    drives itself, 0.30 m, out of the conflict at 0.217 m/s            before others may start,
    starts at the line after 0.3 s and is over it with all its length  before a green may end

(Nigel's figures, see its car file; a lane's speed limit counts if it is less). The card's hash is
published: two people can compare it with the one they agreed on.
"""

import hashlib
import math
from itertools import combinations

import msgspec

from scm.maps.model import CityMap, Conflict, Group, Junction, Lane, StopLine

NIGEL_TOP_MPS = 0.267
NIGEL_SLOW_MPS = 0.217
NIGEL_BRAKES_MPS2 = 0.5
NIGEL_STARTS_MPS2 = 0.5
NIGEL_LENGTH_M = 0.30
REACTS_IN_S = 0.3

_STRIDE_M = 0.005


class CardGroup(msgspec.Struct, kw_only=True, frozen=True):
    """The least times of one group [ns]; clearance counts from the end of its yellow."""

    name: str
    green_ns: int
    yellow_ns: int
    clearance_ns: int


class Card(msgspec.Struct, kw_only=True, frozen=True):
    """Everything the monitor of one junction knows beforehand; pairs are sorted names."""

    junction: str
    groups: tuple[CardGroup, ...]
    conflicts: tuple[tuple[str, str], ...]


def card_hash(card: Card) -> str:
    """Return twelve hexadecimal digits that change with anything on the card."""
    return hashlib.sha256(msgspec.json.encode(card)).hexdigest()[:12]


def card_of(city_map: CityMap, junction: Junction) -> Card:
    """Return the card of a junction."""
    lanes = {lane.name: lane for lane in city_map.lanes}
    lines = [line for line in city_map.stop_lines if line.junction == junction.name]
    return Card(
        junction=junction.name,
        groups=tuple(_group(group, lanes, lines) for group in junction.groups),
        conflicts=tuple(
            (min(one.name, other.name), max(one.name, other.name))
            for one, other in combinations(junction.groups, 2)
            if _meet(one.movement, other.movement, lanes)
        ),
    )


def _group(group: Group, lanes: dict[str, Lane], lines: list[StopLine]) -> CardGroup:
    slow_mps = min(NIGEL_SLOW_MPS, lanes[group.movement.lane].speed_limit_mps)
    farthest_m = max(
        (_to_end_m(line, group.movement, lanes) for line in lines if line.group == group.name),
        default=group.movement.to_m - group.movement.from_m,
    )
    braking_s = NIGEL_TOP_MPS / NIGEL_BRAKES_MPS2
    starting_s = slow_mps / (2.0 * NIGEL_STARTS_MPS2) + NIGEL_LENGTH_M / slow_mps
    return CardGroup(
        name=group.name,
        green_ns=int((REACTS_IN_S + starting_s) * 1e9),
        yellow_ns=int((REACTS_IN_S + braking_s / 2.0) * 1e9),
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
    near_m = (lanes[one.lane].width_m + lanes[other.lane].width_m) / 2.0
    there = _walk(lanes[other.lane], other)
    return one.lane == other.lane or any(
        math.dist(here, place) < near_m for here in _walk(lanes[one.lane], one) for place in there
    )


def _walk(lane: Lane, movement: Conflict) -> list[tuple[float, float]]:
    """Return places along a movement, one every stride, by plain dead reckoning [m]."""
    x, y, yaw = lane.start
    gone_m, places = 0.0, []
    for segment in lane.segments:
        turn_per_m = 0.0
        length_m = segment.length_m or 0.0
        if segment.radius_m is not None and segment.angle_rad is not None:
            turn_per_m = math.copysign(1.0 / segment.radius_m, segment.angle_rad)
            length_m = segment.radius_m * abs(segment.angle_rad)
        strides = max(1, round(length_m / _STRIDE_M))
        stride_m = length_m / strides
        for _ in range(strides):
            yaw += turn_per_m * stride_m / 2.0
            x, y = x + stride_m * math.cos(yaw), y + stride_m * math.sin(yaw)
            yaw += turn_per_m * stride_m / 2.0
            gone_m += stride_m
            if movement.from_m <= gone_m <= movement.to_m:
                places.append((x, y))
    return places
