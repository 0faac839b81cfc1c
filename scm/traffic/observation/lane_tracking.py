"""Which lane a car is on, followed from lane to lane so that noise at joints does not matter."""

import math
from typing import NamedTuple

from scm.geometry import Pose2, wrap_angle
from scm.maps.route import OnLane, Roads
from scm.maps.signs import precedence_at
from scm.traffic.observation.car_estimates import CarEstimate

MAX_HEADING_ERROR_RAD = math.radians(60.0)  # to the lane's direction
MAX_LATERAL_M = 0.06  # beside the middle a car is plainly still on its lane
HYSTERESIS_M = 0.02  # another lane must be nearer by this
LANE_MARGIN_M = 0.03  # outside of a lane's edge still counts as on it
LANE_END_M = 0.005  # from an end a projection may be the end itself


class Lines(NamedTuple):
    """The line at which cars wait on a lane, and what rules it.

    Attributes:
        group: Of the junction's signals; empty: it has none.
        sign: `stop` or `give_way`; empty: neither.
    """

    at_m: float
    junction: str
    group: str
    sign: str


class Followed(NamedTuple):
    """Where a car is now; `before` is the lane it was on until it came here, empty: none."""

    place: OnLane
    before: str


class Follower:
    """Follows all cars along the lanes of a map."""

    def __init__(self, roads: Roads) -> None:
        self._roads = roads
        self._cars: dict[str, Followed] = {}

    def see(self, estimate: CarEstimate) -> Followed | None:
        """Return where a car is; None when it is beside all lanes of its direction."""
        known = self._cars.get(estimate.vehicle)
        found = self._stays(known, estimate) if known is not None else None
        if found is None:
            found = self._moves(known, estimate)
        if found is None:
            self._cars.pop(estimate.vehicle, None)
            return None
        self._cars[estimate.vehicle] = found
        return found

    def forget(self, vehicle: str) -> None:
        """Forget a car that is gone."""
        self._cars.pop(vehicle, None)

    def _stays(self, known: Followed, estimate: CarEstimate) -> Followed | None:
        """Return the place on the same lane if it is plainly still there."""
        lane = self._roads.lanes[known.place.lane]
        s, lateral = lane.project(estimate.x, estimate.y, known.place.s)
        # Beyond an end `project` returns the end itself, but for rounding.
        if not LANE_END_M < s < lane.length_m - LANE_END_M or abs(lateral) > MAX_LATERAL_M:
            return None
        if abs(wrap_angle(lane.yaw_at(s) - estimate.yaw)) > MAX_HEADING_ERROR_RAD:
            return None
        return Followed(OnLane(known.place.lane, s, lateral), known.before)

    def _moves(self, known: Followed | None, estimate: CarEstimate) -> Followed | None:
        """Return the nearest place on a lane that it can have come to, else on any."""
        best: tuple[float, OnLane] | None = None
        if known is not None:
            for name in self._reached(known):
                away, place = self._measure(name, estimate)
                away -= HYSTERESIS_M if name == known.place.lane else 0.0
                if place is not None and (best is None or away < best[0]):
                    best = away, place
        if best is None:
            place = self._roads.nearest(Pose2(estimate.x, estimate.y, estimate.yaw))
            if place is None or abs(place.lateral) > self._room(place.lane):
                return None
            best = 0.0, place
        lane = best[1].lane
        if known is None:
            return Followed(best[1], "")
        before = known.before if lane == known.place.lane else known.place.lane
        return Followed(best[1], before)

    def _reached(self, known: Followed) -> list[str]:
        roads, lane = self._roads, known.place.lane
        names = [lane, *roads.successors(lane)]
        if known.before and lane in roads.successors(known.before):
            names += roads.successors(known.before)
        for name in roads.successors(lane):
            names += roads.successors(name)
        return list(dict.fromkeys(names))

    def _measure(self, name: str, estimate: CarEstimate) -> tuple[float, OnLane | None]:
        lane = self._roads.lanes[name]
        s, lateral = lane.project(estimate.x, estimate.y)
        foot = lane.at(s)
        away = math.hypot(estimate.x - foot.x, estimate.y - foot.y)
        same_way = abs(wrap_angle(foot.yaw - estimate.yaw)) <= MAX_HEADING_ERROR_RAD
        is_there = same_way and away <= self._room(name)
        return away, OnLane(name, s, lateral) if is_there else None

    def _room(self, lane: str) -> float:
        return self._roads.definition(lane).width_m / 2.0 + LANE_MARGIN_M


def rules_of(roads: Roads) -> dict[str, Lines]:
    """Return the last line of each lane that has one."""
    found: dict[str, Lines] = {}
    for lane in roads.city_map.lanes:
        held = roads.signs.get(lane.name, ())
        for line in roads.stop_lines_on(lane.name):
            found[lane.name] = Lines(line.at_m, line.junction, line.group, "")
        for crossing, approach in roads.approaches_on(lane.name):
            sign = precedence_at(held, approach.at_m) or ""
            found[lane.name] = Lines(approach.at_m, crossing, "", sign)
    return found
