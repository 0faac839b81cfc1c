"""Which lanes bend more tightly than a car can turn."""

import math
from dataclasses import dataclass

from scm.maps.polyline import extent
from scm.records.city_map import CityMap, Lane

MAX_CUT_RAD = math.radians(170.0)  # beyond, a cut corner has no finite length


@dataclass(frozen=True, slots=True)
class TightBend:
    """A bend that a car cannot follow inside its lane.

    Attributes:
        lane: Its name.
        radius_m: Of the lane's centre line there.
        outside_m: How far at least the car leaves its lane with a wheel.
    """

    lane: str
    radius_m: float
    outside_m: float


def bends_too_tight(city_map: CityMap, radius_m: float, width_m: float) -> tuple[TightBend, ...]:
    """Return the bends of lanes that a car cannot follow, tightest first, one a lane.

    A short bend can be cut: between two straights that meet at an angle `a`, a wider arc passes
    `(R - r) (1 / cos(a / 2) - 1)` inside the lane's own, and a lane wider than the car has room.

    Args:
        city_map: The city.
        radius_m: Of the tightest circle that the middle of the car's rear axle can drive.
        width_m: Of the car.
    """
    found = (_worst(lane, radius_m, width_m) for lane in city_map.lanes)
    return tuple(sorted((bend for bend in found if bend), key=lambda bend: bend.radius_m))


def _worst(lane: Lane, radius_m: float, width_m: float) -> TightBend | None:
    room = max(0.0, 0.5 * (lane.width_m - width_m))
    bends = []
    for radius, angle in _runs(lane):
        cut = 1.0 / math.cos(0.5 * min(angle, MAX_CUT_RAD)) - 1.0
        outside = (radius_m - radius) * cut - room
        if outside > 0.0:
            bends.append(TightBend(lane.name, radius, outside))
    return min(bends, key=lambda bend: bend.radius_m, default=None)


def _runs(lane: Lane) -> list[tuple[float, float]]:
    """Return the bends to one side, several arcs in a row as one: mean radius, angle."""
    runs: list[list[float]] = []
    side = 0.0
    for length, curvature in map(extent, lane.segments):
        turn = length * abs(curvature)
        now = math.copysign(1.0, curvature) if curvature else 0.0
        if now and now == side:
            runs[-1][0] += length
            runs[-1][1] += turn
        elif now:
            runs.append([length, turn])
        side = now
    return [(length / turn, turn) for length, turn in runs if turn > 0.0]


def misfit(city_map: CityMap, radius_m: float, width_m: float) -> str:
    """Say which lanes a car cannot follow, in a sentence; empty: it can follow all.

    Args:
        city_map: The city.
        radius_m: Of the tightest circle that the middle of the car's rear axle can drive.
        width_m: Of the car.
    """
    return "; ".join(
        filter(None, (_narrow(city_map, width_m), _bends(city_map, radius_m, width_m)))
    )


def _narrow(city_map: CityMap, width_m: float) -> str:
    narrow = [lane for lane in city_map.lanes if lane.width_m < width_m]
    if not narrow:
        return ""
    least = min(narrow, key=lambda lane: lane.width_m)
    return (
        f"it is {width_m:.2f} m wide, wider than {_count(len(narrow), 'lane')} of this map: "
        f"{least.name} is {least.width_m:.2f} m wide"
    )


def _bends(city_map: CityMap, radius_m: float, width_m: float) -> str:
    bends = bends_too_tight(city_map, radius_m, width_m)
    if not bends:
        return ""
    worst = max(bends, key=lambda bend: bend.outside_m)
    more = f", and {_count(len(bends) - 1, 'lane')} more" if len(bends) > 1 else ""
    return (
        f"it turns on a radius of {radius_m:.2f} m at best: lane {worst.lane} bends at "
        f"{worst.radius_m:.2f} m, so it would leave it by {100.0 * worst.outside_m:.0f} cm{more}"
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
