"""Trips of a batch of drivers: route requests in, progress reports out.

A car circulates until it is sent somewhere. A request becomes a route, and each car's progress is
reported in `Trip` messages: twice a second, and at once on arrival.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal

import numpy as np

from scm.arrays import AnyArray
from scm.clock import NS_PER_S
from scm.errors import LeaseError, MapError
from scm.geometry import Pose2
from scm.maps.route import OnLane
from scm.v2x.messages.handover_request import HandedDriver
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.driver_state import WAITING_FOR

REPORT_NS = NS_PER_S // 2
GOLDEN_RATIO = 0.618034  # spreads the reports of consecutive indices evenly
REMEDY = "drive it there by hand, or take it off the map and spawn it again"
_NOW_NS = -(2**62)


@dataclass(slots=True)
class ActiveTrip:
    """What is known of a car's present trip, or of its last one."""

    vehicle: str
    trip_id: str
    route: tuple[str, ...]
    length_m: float | None
    started_ns: int
    count: int
    passes: tuple[tuple[str, float], ...] = ()
    """The requested lanes, laps written out, and the distance at which each of them ends."""
    speed_mps: float | None = None
    then: Literal["stop", "circulate"] = "stop"
    is_ended: bool = False
    """Whether somebody else drove the car since."""


class Trips:
    """The trips of a batch of drivers.

    Args:
        drivers: The batch.
        every_ns: Interval of each car's reports.
        spread: Whether the cars' reports are spread over that interval.
    """

    def __init__(
        self, drivers: DriverBatch, every_ns: int = REPORT_NS, *, spread: bool = False
    ) -> None:
        self.every_ns = every_ns
        self._drivers = drivers
        self._spread = spread
        self._trips: dict[int, ActiveTrip] = {}
        self._due_ns = np.zeros(drivers.capacity, np.int64)
        self._under_way = np.zeros(drivers.capacity, np.bool_)
        self._unsent: list[Trip] = []

    def circulate(self, index: int, vehicle: str, pose: Pose2, now_ns: int) -> tuple[str, ...]:
        """Let a car circulate without end from where it stands; return its first lanes.

        Raises:
            MapError: when it stands beside all lanes or on a lane that leads nowhere, or would hit
                a wall on its way to the lane.
        """
        place = self._nearest_lane(vehicle, pose)
        self._check_way(index, vehicle, (place.lane,), place, pose, "circulate")
        route = self._drivers.circulate(index, place.lane, place.s)
        self._note(index, vehicle, route, None, now_ns, "")
        return route

    def begin(
        self, index: int, vehicle: str, request: RouteRequest, pose: Pose2, now_ns: int
    ) -> RouteReply:
        """Send a car on a trip from where it is; a trip under way ends without arrival.

        Raises:
            MapError: when the lanes do not exist or cannot be reached, or the car would hit a wall
                on its way to its lane.
            LeaseError: when the request may replace only a trip that the car is not on.
        """
        if request.replaces:
            self._check_trip(index, request.replaces)
        place, roads = self._nearest_lane(vehicle, pose), self._drivers.lane_graph.roads
        length_m: float | None = None
        passes: tuple[tuple[str, float], ...] = ()
        if request.via:
            route = roads.route(place.lane, request.via, request.laps)
            self._check_way(index, vehicle, route, place, pose, request.then, request.speed_mps)
            self._drivers.send(index, route, place.s, request.then, request.speed_mps)
            ends_m = [m - place.s for m in accumulate(map(roads.length_of, route))]
            length_m, passes = ends_m[-1], _passes(request, route, ends_m)
        else:
            lane, speed_mps = (place.lane,), request.speed_mps
            self._check_way(index, vehicle, lane, place, pose, "circulate", speed_mps)
            route = self._drivers.circulate(index, place.lane, place.s, speed_mps)
        trip = self._note(index, vehicle, route, length_m, now_ns, request.request_id)
        trip.passes, trip.speed_mps, trip.then = passes, request.speed_mps, request.then
        return RouteReply(vehicle=vehicle, trip_id=trip.trip_id, route=route, length_m=length_m)

    def _check_trip(self, index: int, trip_id: str) -> None:
        """Raise LeaseError unless a car is on a trip, or stands since it arrived."""
        trip = self._trips.get(index)
        if trip is None or trip.trip_id != trip_id:
            on = "no trip" if trip is None else f"trip {trip.trip_id!r}"
            raise LeaseError(f"it is on {on}, expected {trip_id!r}")
        if trip.is_ended:
            raise LeaseError(f"somebody drove it since its trip {trip_id!r}")

    def end(self, index: int, now_ns: int) -> None:
        """End a car's trip with a last report: somebody else drives it now."""
        if self._under_way[index]:
            self._unsent.append(self._report(index, now_ns))
        if index in self._trips:
            self._trips[index].is_ended = True
        self._halt(index)

    def _halt(self, index: int) -> None:
        self._drivers.halt(index)
        self._under_way[index] = False

    def forget(self, index: int) -> None:
        """Remove a car; its vehicle index is free for another one."""
        self._halt(index)
        self._trips.pop(index, None)

    def enter(
        self, index: int, vehicle: str, lane: str, s: float, driver: HandedDriver, now_ns: int
    ) -> None:
        """Let a car that comes from another city drive on from a place on its first lane here.

        It circulates, or drives to the end of that lane if its trip was to end there or no way
        leads on.

        Raises:
            MapError: when there is no such lane.
        """
        graph, speed = self._drivers.lane_graph, driver.speed_mps
        route: tuple[str, ...] = (graph.roads.check_lane(lane),)
        if driver.then == "circulate" and graph.goes_round[graph.numbers[lane]]:
            route = self._drivers.circulate(index, lane, s, speed)
            length_m = None
        else:
            self._drivers.send(index, route, s, "stop", speed)
            length_m = graph.roads.length_of(lane) - s
        self._note(index, vehicle, route, length_m, now_ns, "").speed_mps = speed

    def leave(self, index: int, now_ns: int) -> None:
        """End the trip of a car that drives into another city: it has arrived there."""
        if self._under_way[index]:
            self._unsent.append(self._report(index, now_ns, arrived_ns=now_ns))
        self._halt(index)

    def memory(self, index: int) -> tuple[AnyArray, ...]:
        """Return views of all that is stored of a car, except its trip."""
        return self._due_ns[index : index + 1], self._under_way[index : index + 1]

    def trip(self, index: int) -> ActiveTrip | None:
        """Return a car's trip, or its last one."""
        return self._trips.get(index)

    def resume(self, index: int, trip: ActiveTrip | None) -> None:
        """Give a car whose `memory` was written the trip that belongs to it."""
        if trip is not None:
            self._trips[index] = trip

    def check_arrivals(self, now_ns: int) -> None:
        """Handle new arrivals; call it after each decision of the batch."""
        for index in np.flatnonzero(self._under_way & self._drivers.arrived).tolist():
            trip = self._trips[index]
            self._unsent.append(self._report(index, now_ns, arrived_ns=now_ns))
            self._under_way[index] = False
            if trip.then == "circulate":
                route = self._drivers.go_on(index)
                after = self._note(index, trip.vehicle, route, None, now_ns, "")
                after.speed_mps = trip.speed_mps

    def reports(self, now_ns: int) -> list[Trip]:
        """Return the reports that are due."""
        unsent, self._unsent = self._unsent, []
        due = np.flatnonzero(self._under_way & (self._due_ns <= now_ns))
        self._due_ns[due] = now_ns + self.every_ns
        for index in due.tolist():
            if self._spread:
                self._due_ns[index] += self._lag_ns(index, now_ns)
            unsent.append(self._report(index, now_ns))
        return unsent

    def _lag_ns(self, index: int, now_ns: int) -> int:
        """Return the negative delay that spreads a car's reports over the interval."""
        turn_ns = int(index * GOLDEN_RATIO % 1.0 * self.every_ns)
        return -((now_ns - turn_ns) % self.every_ns)

    def _report(self, index: int, now_ns: int, arrived_ns: int | None = None) -> Trip:
        trip, drivers = self._trips[index], self._drivers
        done_m = float(drivers.done_m[index])
        return Trip(
            vehicle=trip.vehicle,
            trip_id=trip.trip_id,
            t_ns=now_ns,
            route=trip.route,
            done_m=done_m,
            length_m=trip.length_m,
            started_ns=trip.started_ns,
            arrived_ns=arrived_ns,
            waiting_for=WAITING_FOR[drivers.waiting[index]],
            via=tuple(lane for lane, end_m in trip.passes if end_m > done_m),
            speed_mps=trip.speed_mps,
            then=trip.then,
        )

    def _note(
        self,
        index: int,
        vehicle: str,
        route: Sequence[str],
        length_m: float | None,
        now_ns: int,
        trip_id: str,
    ) -> ActiveTrip:
        before = self._trips.get(index)
        count = 1 + (before.count if before is not None and before.vehicle == vehicle else 0)
        trip_id = trip_id or f"{vehicle}-{count}"
        trip = ActiveTrip(vehicle, trip_id, tuple(route), length_m, now_ns, count)
        self._trips[index] = trip
        self._due_ns[index] = _NOW_NS
        self._under_way[index] = True
        return trip

    def _nearest_lane(self, vehicle: str, pose: Pose2) -> OnLane:
        place = self._drivers.lane_graph.roads.nearest(pose)
        if place is None:
            msg = f"{vehicle}: no lane in its direction at ({pose.x:.2f}, {pose.y:.2f}) m; {REMEDY}"
            raise MapError(msg)
        return place

    def _check_way(
        self,
        index: int,
        vehicle: str,
        route: Sequence[str],
        place: OnLane,
        pose: Pose2,
        after: str,
        speed: float | None = None,
    ) -> None:
        """Raise MapError if the car would hit a wall before it is on its lane."""
        distance = self._drivers.wall_ahead(index, route, place.s, pose, after, speed)
        if distance is not None:
            msg = f"{vehicle}: it would hit a wall {distance:.2f} m ahead, on its way to lane "
            raise MapError(f"{msg}{place.lane}; {REMEDY}")


def _passes(
    request: RouteRequest, route: Sequence[str], ends_m: Sequence[float]
) -> tuple[tuple[str, float], ...]:
    """Return the requested lanes and the distance along the route at which each of them ends."""
    at, passes = -1, []
    for lane in request.via * request.laps:
        at = route.index(lane, at + 1)
        passes.append((lane, ends_m[at]))
    return tuple(passes)
