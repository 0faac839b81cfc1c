"""Four cars meet where there are no lights, and only the radio tells them of each other.

Each approaches from another side. All must stop, and who stood there first goes first: the cars
find out who that is from their CAMs alone. Where they start, and when, varies with the seed.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.maps.grid_city import grid_city
from scm.records.city_map import Sign
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.study.case import Case
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.route_request import RouteRequest
from scm.world.driving import send
from scm.world.part import WorldPart

ARMS = {"e": "j0_1_e", "n": "j1_0_n", "w": "j2_1_w", "s": "j1_2_s"}
"""The lane by which each car approaches, by where it is heading."""
LINE_M = 4.78  # along that lane
BEFORE_M = 0.9
STEP_S = 0.1
LANES_OF_CROSSING = 2  # over the junction, and out of it
X_M, Y_M = (-0.07, 0.23), (-0.0875, 0.0875)  # outline of a Nigel from its rear axle

MAP = replace(
    grid_city(3, 3, block_m=6.0, signs=True),
    signs=tuple(
        Sign(sign_id=n, kind="stop", x_m=0.0, y_m=0.0, yaw_rad=0.0, lane=lane, at_m=LINE_M)
        for n, lane in enumerate(ARMS.values(), start=1)
    ),
)
"""The middle junction has four stop signs and no lights."""


class Start(NamedTuple):
    """Where a car stands before its line [m], and when it sets out [s]."""

    before_m: float = BEFORE_M
    after_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Crossed:
    """What happened at the junction.

    Attributes:
        across_s: When each car was over it; inf: not at all.
        least_distance_m: Between the outlines of any two cars, every 0.1 s; 0: they overlap.
        collisions: How many pairs of cars touched, by the world's `Contact` messages.
    """

    across_s: Mapping[str, float]
    least_distance_m: float
    collisions: int


def run(
    case: Case, start_spread_m: float = 0.4, start_spread_s: float = 2.0, duration_s: float = 90.0
) -> dict[str, float]:
    """Return how many cars got across, when the last did, and how near they came to each other.

    Args:
        case: The case.
        start_spread_m: Cars start anywhere on so much of their lanes, evenly spread.
        start_spread_s: And at any time within so long.
        duration_s: How long they have.
    """
    rng = case.generator("starts")
    starts = {
        arm: Start(BEFORE_M + start_spread_m * rng.random(), start_spread_s * rng.random())
        for arm in ARMS
    }
    world = case.world(room=len(ARMS))
    with case.lockstep([world]) as city:
        crossed = cross(city, world, starts, duration_s)
    times = crossed.across_s.values()
    across = sum(time < math.inf for time in times)
    return {
        "collisions": crossed.collisions,
        "least_distance_m": crossed.least_distance_m,
        "across": across,
        "time_s": max(times) if across == len(ARMS) else math.nan,
    }


def cross(
    city: Lockstep, part: WorldPart, starts: Mapping[str, Start], duration_s: float
) -> Crossed:
    """Let cars drive straight on over the middle junction until all are across, or time is up.

    Args:
        city: Not begun yet.
        part: Its world, on `MAP`.
        starts: By the arm from which a car comes.
        duration_s: Longest time.
    """
    world, least_m = part.world, math.inf
    contacts = city.subscribe(Subscription(Contact, {}))
    cars = {
        arm: world.host(arm, "nigel", world.roads.lane(ARMS[arm]).at(LINE_M - start.before_m), 0)
        for arm, start in starts.items()
    }
    waiting, across_s = dict(starts), dict.fromkeys(cars, math.inf)
    for step in range(round(duration_s / STEP_S)):
        for arm in [arm for arm, start in waiting.items() if start.after_s <= STEP_S * step]:
            del waiting[arm]
            route = RouteRequest(vehicle=arm, via=(f"j1_1_{arm}{arm}", f"j1_1_{arm}"))
            send(world, cars[arm], route, city.now_ns)
        city.run_for(STEP_S)
        poses = [car.pose for car in cars.values()]
        least_m = min(least_m, *(_apart(*pair) for pair in itertools.permutations(poses, 2)))
        for arm, car in cars.items():
            if world.drivers.passed[car.index] >= LANES_OF_CROSSING:
                across_s[arm] = min(across_s[arm], STEP_S * step)
        if max(across_s.values()) < math.inf:
            break
    touched = {
        frozenset((contact.vehicle, other))
        for contact in (incoming.message for incoming in contacts.drain())
        if isinstance(contact, Contact)
        for other in contact.against
        if other in cars
    }
    return Crossed(across_s, least_m, len(touched))


def _apart(one: Pose2, other: Pose2) -> float:
    """Return how far the corners of one car are from the outline of another [m]; 0: inside."""
    corners = np.array([one.apply(x, y) for x in X_M for y in Y_M])
    dx, dy = corners[:, 0] - other.x, corners[:, 1] - other.y
    c, s = math.cos(other.yaw), math.sin(other.yaw)
    beyond = [_beyond(c * dx + s * dy, X_M), _beyond(c * dy - s * dx, Y_M)]
    return float(np.hypot(*beyond).min())


def _beyond(values: Floats, span: tuple[float, float]) -> Floats:
    """Return how far values are outside a span."""
    return np.maximum(np.maximum(span[0] - values, values - span[1]), 0.0)
