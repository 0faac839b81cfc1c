"""The trips of one car: it circulates until it is sent somewhere, and tells how far it is.

Whoever drives the car, the world or its agent, keeps one `Trips` for it: a route request becomes a
path for the route driver, and its progress becomes `Trip` messages.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

from scm.clock import NS_PER_S
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.route import OnLane, Path, Roads
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.route import RouteDriver

REPORT_NS = NS_PER_S // 2
LANES_BEYOND = 2


@dataclass(slots=True)
class _Trip:
    trip_id: str
    route: tuple[str, ...]
    length_m: float | None
    started_ns: int
    goes_on: bool
    arrived_ns: int | None = None
    reported_ns: int | None = None


class Trips:
    """Where one car was sent, and the driver that takes it there.

    Attributes:
        driver: Of the present trip.
    """

    def __init__(
        self, vehicle: str, roads: Roads, limits: CarLimits, pose: Pose2, now_ns: int
    ) -> None:
        """Begin to circulate from where the car stands.

        Raises:
            MapError: when it stands beside all lanes, or on one that leads nowhere.
        """
        self._vehicle = vehicle
        self._roads = roads
        self._count = 0
        self._unsent: list[Trip] = []
        place = self._place(pose)
        path = self._round(place.lane)
        self.driver = RouteDriver(path, limits, near=place.s)
        self._trip = self._new(path.lanes, None, now_ns)

    def begin(self, request: RouteRequest, pose: Pose2, now_ns: int) -> RouteReply:
        """Send the car on a trip from where it is; a trip under way ends without arrival.

        Raises:
            MapError: when the lanes do not exist or cannot be reached.
        """
        place = self._place(pose)
        if request.via:
            route = self._roads.route(place.lane, request.via, request.laps)
            length_m: float | None = self._length(route) - place.s
            goes_on = request.then == "circulate"
            path = Path(self._roads, self._beyond(route) if goes_on else route)
        else:
            path, length_m, goes_on = self._round(place.lane), None, True
            route = path.lanes
        self.driver.follow(path, speed=request.speed_mps, trip_m=length_m, near=place.s)
        self._trip = self._new(route, length_m, now_ns, request.request_id)
        self._trip.goes_on = goes_on
        return RouteReply(
            vehicle=self._vehicle, trip_id=self._trip.trip_id, route=route, length_m=length_m
        )

    def decide(self, view: RouteView) -> tuple[float, float]:
        """Return (throttle, steering); on arrival go on circulating where that was asked for."""
        commands = self.driver.decide(view)
        if self.driver.arrived and self._trip.arrived_ns is None:
            self._trip.arrived_ns = view.now_ns
            self._unsent.append(self._report(view.now_ns))
            if self._trip.goes_on:
                self._circulate(view)
        return commands

    def reports(self, now_ns: int) -> list[Trip]:
        """Return what is to be told of the trip now: twice a second, and when it ended."""
        unsent, self._unsent = self._unsent, []
        trip = self._trip
        if trip.arrived_ns is None and _due(trip.reported_ns, now_ns):
            trip.reported_ns = now_ns
            unsent.append(self._report(now_ns))
        return unsent

    def _circulate(self, view: RouteView) -> None:
        place = self._place(view.pose)
        path = self._round(place.lane)
        self.driver.follow(path, near=place.s)
        self._trip = self._new(path.lanes, None, view.now_ns)

    def _report(self, now_ns: int) -> Trip:
        trip = self._trip
        return Trip(
            vehicle=self._vehicle,
            trip_id=trip.trip_id,
            t_ns=now_ns,
            route=trip.route,
            done_m=self.driver.done_m,
            length_m=trip.length_m,
            started_ns=trip.started_ns,
            arrived_ns=trip.arrived_ns,
            waiting_for=self.driver.waiting_for,
        )

    def _new(
        self, route: tuple[str, ...], length_m: float | None, now_ns: int, trip_id: str = ""
    ) -> _Trip:
        self._count += 1
        trip_id = trip_id or f"{self._vehicle}-{self._count}"
        return _Trip(trip_id, route, length_m, now_ns, goes_on=True)

    def _place(self, pose: Pose2) -> OnLane:
        place = self._roads.nearest(pose)
        if place is None:
            msg = f"{self._vehicle}: no lane runs its way at ({pose.x:.2f}, {pose.y:.2f}) m"
            raise MapError(msg)
        return place

    def _round(self, lane: str) -> Path:
        return Path.circulation(self._roads, lane)

    def _length(self, route: Sequence[str]) -> float:
        return sum(self._roads.lane(name).length_m for name in route)

    def _beyond(self, route: tuple[str, ...]) -> tuple[str, ...]:
        following = islice(self._roads.circulate(route[-1]), 1, 1 + LANES_BEYOND)
        return route + tuple(following)


def _due(last_ns: int | None, now_ns: int) -> bool:
    return last_ns is None or now_ns - last_ns >= REPORT_NS
