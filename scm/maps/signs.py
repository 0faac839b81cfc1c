"""What traffic signs mean: who gives way at a line, how fast one may go, where one may turn.

A speed limit holds from its sign to the end of the lane; a turn sign holds for the lane's end.
"""

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

from scm.geometry import Pose2
from scm.maps.polyline import extent
from scm.records.city_map import CityMap, Lane, Sign

Turn = Literal["left", "straight", "right"]
Precedence = Literal["stop", "give_way"]

CURVES = ("left_curve", "right_curve")
PRECEDENCE: tuple[Precedence, ...] = ("stop", "give_way")
SPEED_LIMIT = "speed_limit"
TURNS: Mapping[str, frozenset[Turn]] = {
    "no_left": frozenset({"straight", "right"}),
    "no_right": frozenset({"straight", "left"}),
    "no_straight": frozenset({"left", "right"}),
    "only_left": frozenset({"left"}),
    "only_right": frozenset({"right"}),
    "only_straight": frozenset({"straight"}),
}
SIGN_KINDS = (*CURVES, *PRECEDENCE, SPEED_LIMIT, *TURNS)

MIN_TURN_RAD = math.radians(30.0)
BESIDE_M = 0.5
LINE_DISTANCE_M = 0.5  # of a sign that belongs to a line


class Held(NamedTuple):
    """A sign that cars obey, and where: on which lane, and from where on it [m]."""

    sign: Sign
    lane: str
    at_m: float


def turn_of(lane: Lane) -> Turn:
    """Return which way a lane turns from its start to its end."""
    turned = sum(length * curvature for length, curvature in map(extent, lane.segments))
    if abs(turned) < MIN_TURN_RAD:
        return "straight"
    return "left" if turned > 0.0 else "right"


def looks_along(sign: Sign) -> Pose2:
    """Return the sign's place with the heading of the cars that its face looks at."""
    return Pose2(sign.x_m, sign.y_m, sign.yaw_rad + math.pi)


def allowed_next(lane: Lane, lanes: Mapping[str, Lane], signs: tuple[Sign, ...]) -> tuple[str, ...]:
    """Return the lanes after a lane that its turn signs allow, in the order of the map."""
    following = lane.next
    for sign in signs:
        allowed = TURNS.get(sign.kind)
        if allowed is not None:
            following = tuple(name for name in following if turn_of(lanes[name]) in allowed)
    return following


def precedence_at(held: tuple[Held, ...], at_m: float) -> Precedence | None:
    """Return what the signs of a lane say at a line on it; None: nothing.

    A sign means the line that it stands at, or the next one within half a metre.
    """
    for kind in PRECEDENCE:
        for one in held:
            if one.sign.kind == kind and -LINE_DISTANCE_M <= one.at_m - at_m <= LINE_DISTANCE_M:
                return kind
    return None


def is_obeyed(sign: Sign) -> bool:
    """Return whether a sign tells a driver what to do, and does not only warn."""
    return sign.kind not in CURVES


def lines_of(city_map: CityMap) -> list[tuple[str, float]]:
    """Return lane and place of every line at which cars wait, with lights or without."""
    lines = [(line.lane, line.at_m) for line in city_map.stop_lines]
    return lines + [(a.lane, a.at_m) for c in city_map.crossings for a in c.approaches]
