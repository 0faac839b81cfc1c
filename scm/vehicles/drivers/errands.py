"""The errands of a crowd: route requests in, progress out.

A car circulates until it is sent somewhere. A request becomes lanes for the crowd, and how far each
car is becomes `Trip` messages: twice a second, and at once when it arrives.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal

import numpy as np

from scm.clock import NS_PER_S
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.route import OnLane
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.vehicles.drivers.driver_batch import Crowd
from scm.vehicles.drivers.memory import WAITING_FOR

REPORT_NS = NS_PER_S // 2
SPREAD = 0.618034
BY_HAND = "drive it there by hand, or take it off the map and spawn it again"
_SOON = -(2**62)


@dataclass(slots=True)
class _Errand:
    vehicle: str
    trip_id: str
    route: tuple[str, ...]
    length_m: float | None
    started_ns: int
    count: int
    passes: tuple[tuple[str, float], ...] = ()
    """The lanes asked for, laps written out, and how far along the route each of them ends."""
    speed_mps: float | None = None
    then: Literal["stop", "circulate"] = "stop"


class Errands:
    """Where the cars of a crowd were sent; see the module.

    Args:
        crowd: Drives them.
        every_ns: How often each car's progress is told.
        spread: Whether the cars' reports are spread over that time.
    """

    def __init__(self, crowd: Crowd, every_ns: int = REPORT_NS, *, spread: bool = False) -> None:
        self.every_ns = every_ns
        self._crowd = crowd
        self._spread = spread
        self._errands: dict[int, _Errand] = {}
        self._due_ns = np.zeros(crowd.capacity, np.int64)
        self._under_way = np.zeros(crowd.capacity, np.bool_)
        self._unsent: list[Trip] = []

    def circulate(self, slot: int, vehicle: str, pose: Pose2, now_ns: int) -> tuple[str, ...]:
        """Send a car round without end, from where it stands; return the lanes it takes first.

        Raises:
            MapError: when it stands beside all lanes, or on one that leads nowhere, or would hit a
                wall on its way to its lane.
        """
        place = self._place(vehicle, pose)
        self._check_way(slot, vehicle, (place.lane,), place, pose, "circulate")
        route = self._crowd.circulate(slot, place.lane, place.s)
        self._note(slot, vehicle, route, None, now_ns, "")
        return route

    def begin(
        self, slot: int, vehicle: str, request: RouteRequest, pose: Pose2, now_ns: int
    ) -> RouteReply:
        """Send a car on a trip from where it is; a trip under way ends without arrival.

        Raises:
            MapError: when the lanes do not exist or cannot be reached, or the car would hit a wall
                on its way to its lane.
        """
        place, roads = self._place(vehicle, pose), self._crowd.streets.roads
        length_m: float | None = None
        passes: tuple[tuple[str, float], ...] = ()
        if request.via:
            route = roads.route(place.lane, request.via, request.laps)
            self._check_way(slot, vehicle, route, place, pose, request.then, request.speed_mps)
            self._crowd.send(slot, route, place.s, request.then, request.speed_mps)
            ends_m = [m - place.s for m in accumulate(map(roads.length_of, route))]
            length_m, passes = ends_m[-1], _passes(request, route, ends_m)
        else:
            lane, speed_mps = (place.lane,), request.speed_mps
            self._check_way(slot, vehicle, lane, place, pose, "circulate", speed_mps)
            route = self._crowd.circulate(slot, place.lane, place.s, speed_mps)
        errand = self._note(slot, vehicle, route, length_m, now_ns, request.request_id)
        errand.passes, errand.speed_mps, errand.then = passes, request.speed_mps, request.then
        return RouteReply(vehicle=vehicle, trip_id=errand.trip_id, route=route, length_m=length_m)

    def end(self, slot: int, now_ns: int) -> None:
        """Forget a car's trip, but for a last word on it: somebody else drives it now."""
        if self._under_way[slot]:
            self._unsent.append(self._report(slot, now_ns))
        self._halt(slot)

    def _halt(self, slot: int) -> None:
        self._crowd.halt(slot)
        self._under_way[slot] = False

    def forget(self, slot: int) -> None:
        """Forget that a car was ever sent; its slot is free for another one."""
        self._halt(slot)
        self._errands.pop(slot, None)

    def look(self, now_ns: int) -> None:
        """See who has arrived since the last time: after each decision of the crowd."""
        for slot in np.flatnonzero(self._under_way & self._crowd.arrived).tolist():
            errand = self._errands[slot]
            self._unsent.append(self._report(slot, now_ns, arrived_ns=now_ns))
            self._under_way[slot] = False
            if errand.then == "circulate":
                route = self._crowd.go_on(slot)
                after = self._note(slot, errand.vehicle, route, None, now_ns, "")
                after.speed_mps = errand.speed_mps

    def reports(self, now_ns: int) -> list[Trip]:
        """Return what is to be told now."""
        unsent, self._unsent = self._unsent, []
        due = np.flatnonzero(self._under_way & (self._due_ns <= now_ns))
        self._due_ns[due] = now_ns + self.every_ns
        for slot in due.tolist():
            if self._spread:
                self._due_ns[slot] += self._lag_ns(slot, now_ns)
            unsent.append(self._report(slot, now_ns))
        return unsent

    def _lag_ns(self, slot: int, now_ns: int) -> int:
        """Return by how much a car's next report must come earlier to be in its own turn."""
        turn_ns = int(slot * SPREAD % 1.0 * self.every_ns)
        return -((now_ns - turn_ns) % self.every_ns)

    def _report(self, slot: int, now_ns: int, arrived_ns: int | None = None) -> Trip:
        errand, crowd = self._errands[slot], self._crowd
        done_m = float(crowd.done_m[slot])
        return Trip(
            vehicle=errand.vehicle,
            trip_id=errand.trip_id,
            t_ns=now_ns,
            route=errand.route,
            done_m=done_m,
            length_m=errand.length_m,
            started_ns=errand.started_ns,
            arrived_ns=arrived_ns,
            waiting_for=WAITING_FOR[crowd.waiting[slot]],
            via=tuple(lane for lane, end_m in errand.passes if end_m > done_m),
            speed_mps=errand.speed_mps,
            then=errand.then,
        )

    def _note(
        self,
        slot: int,
        vehicle: str,
        route: Sequence[str],
        length_m: float | None,
        now_ns: int,
        trip_id: str,
    ) -> _Errand:
        before = self._errands.get(slot)
        count = 1 + (before.count if before is not None and before.vehicle == vehicle else 0)
        trip_id = trip_id or f"{vehicle}-{count}"
        errand = _Errand(vehicle, trip_id, tuple(route), length_m, now_ns, count)
        self._errands[slot] = errand
        self._due_ns[slot] = _SOON
        self._under_way[slot] = True
        return errand

    def _place(self, vehicle: str, pose: Pose2) -> OnLane:
        place = self._crowd.streets.roads.nearest(pose)
        if place is None:
            msg = f"{vehicle}: no lane runs its way at ({pose.x:.2f}, {pose.y:.2f}) m; {BY_HAND}"
            raise MapError(msg)
        return place

    def _check_way(
        self,
        slot: int,
        vehicle: str,
        route: Sequence[str],
        place: OnLane,
        pose: Pose2,
        after: str,
        speed: float | None = None,
    ) -> None:
        """Refuse a route where the car would hit a wall before it is on its lane."""
        gone = self._crowd.wall_ahead(slot, route, place.s, pose, after, speed)
        if gone is not None:
            msg = f"{vehicle}: it would hit a wall {gone:.2f} m ahead, on its way to lane "
            raise MapError(f"{msg}{place.lane}; {BY_HAND}")


def _passes(
    request: RouteRequest, route: Sequence[str], ends_m: Sequence[float]
) -> tuple[tuple[str, float], ...]:
    """Return the lanes asked for and where along the route each of them ends."""
    at, passes = -1, []
    for lane in request.via * request.laps:
        at = route.index(lane, at + 1)
        passes.append((lane, ends_m[at]))
    return tuple(passes)
