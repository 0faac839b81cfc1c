"""Fleet scripts: spawn cars, send them on routes, switch signal plans, collect travel times.

    with open_city("driving_school") as city:                                   # in lockstep
    with open_city("driving_school", connect="tcp/127.0.0.1:7447") as city:     # live, over the bus

The script is the same: in lockstep waiting moves a stepped clock and takes no longer than the
computation; live it waits for the real city.

A travel time during which signals flashed, a part of the city was lost or the computer was too slow
is void: reading it raises `VoidError` with the reasons.
"""

import itertools
import logging
import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import msgspec

from scm.caller import program_name
from scm.clock import WallClock, seconds
from scm.disturbances import MESSAGE_KINDS, Disturbances
from scm.errors import RunError, ScmError, VoidError, nearest
from scm.log import event
from scm.maps.load import load_map
from scm.records.disturbances import Disturbance
from scm.runtime.city_link import Keep, Link
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Part, Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.credentials import read_credentials
from scm.v2x.exchange import Incoming
from scm.v2x.message import Message, Refused, Request
from scm.v2x.messages.park_request import ParkReply, ParkRequest
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.request_retry import send_request
from scm.world.part import WorldPart

R = TypeVar("R", bound=Message)
THEN = ("circulate", "stop")
MAILBOX_DEPTH = 1000
FILTERED_MAILBOX_DEPTH = 1_000_000  # never full: it stores at most one arrival per car
REPLY_TIMEOUT_S = (
    15.0  # the first car of a type may have to be compiled; an absent part fails at once
)

_log = logging.getLogger(__name__)


class LockstepLink:
    """The city in this process, on a stepped clock."""

    def __init__(self, lockstep: Lockstep) -> None:
        self._lockstep = lockstep

    @property
    def now_ns(self) -> int:
        """The stepped clock's time [ns]."""
        return self._lockstep.now_ns

    def request(self, request: Request) -> Message:
        """Step the city until the reply arrives."""
        return self._lockstep.call(request)

    def subscribe(self, subscription: Subscription, keep: Keep | None = None) -> Mailbox:
        """Return a mailbox on the in-memory bus."""
        return self._lockstep.subscribe(subscription, keep)

    def publish(self, message: Message) -> None:
        """Send on the in-memory bus."""
        self._lockstep.publish(message)

    def run_until(self, done: Callable[[], bool], timeout_s: float) -> bool:
        """Step the city until `done()`."""
        try:
            self._lockstep.run_until(done, timeout_s)
        except RunError:
            return False
        return True


class LiveLink:
    """A running city, over Zenoh."""

    def __init__(self, bus: ZenohBus) -> None:
        self._bus = bus
        self._clock = WallClock()
        self._wake = threading.Event()

    @property
    def now_ns(self) -> int:
        """This process's time [ns]."""
        return self._clock.now_ns()

    def request(self, request: Request) -> Message:
        """Wait for the reply."""
        signed = msgspec.structs.replace(request, actor=request.actor or program_name())
        return send_request(self._bus, signed, REPLY_TIMEOUT_S)

    def subscribe(self, subscription: Subscription, keep: Keep | None = None) -> Mailbox:
        """Return a mailbox subscribed on the bus."""
        mailbox = Mailbox(
            MAILBOX_DEPTH if keep is None else FILTERED_MAILBOX_DEPTH, self._wake, keep
        )
        self._bus.subscribe(subscription.kind, subscription.where, mailbox)
        return mailbox

    def publish(self, message: Message) -> None:
        """Send on the bus."""
        self._bus.publish(message)

    def run_until(self, done: Callable[[], bool], timeout_s: float) -> bool:
        """Wait; check again whenever a message arrives."""
        deadline = self.now_ns + round(timeout_s * 1e9)
        while not done():
            if self.now_ns >= deadline:
                return False
            self._clock.wait_until(min(deadline, self.now_ns + 100_000_000), self._wake)
            self._wake.clear()
        return True


@dataclass(eq=False)
class Journey:
    """One trip of one car.

    Attributes:
        route: The lanes it follows.
        length_m: Of the route; None: it has no end.
        started_ns, arrived_ns: On the city's clock; None while under way. Updated whenever the
            script lets the city run or sends it a request.
    """

    vehicle: str
    trip_id: str
    disturbances: Disturbances = field(repr=False)
    route: tuple[str, ...] = ()
    length_m: float | None = None
    started_ns: int | None = None
    arrived_ns: int | None = None

    @property
    def void(self) -> tuple[str, ...]:
        """Why its travel time is void; empty if it is valid, or the trip is under way."""
        if self.started_ns is None or self.arrived_ns is None:
            return ()
        return self.disturbances.void_reasons(self.started_ns, self.arrived_ns)

    @property
    def duration_s(self) -> float | None:
        """From start to arrival, void or not; None while under way."""
        if self.started_ns is None or self.arrived_ns is None:
            return None
        return seconds(self.arrived_ns - self.started_ns)

    @property
    def travel_time_s(self) -> float | None:
        """From start to arrival; None while under way.

        Raises:
            VoidError: with the reasons, see `void`.
        """
        if reasons := self.void:
            msg = f"the trip of {self.vehicle} is void: {'; '.join(reasons)}"
            raise VoidError(msg)
        return self.duration_s


@dataclass(eq=False)
class FleetCar:
    """A car that the script has spawned."""

    name: str
    city: "City" = field(repr=False)

    def drive(
        self, *via: str, laps: int = 1, speed_mps: float | None = None, then: str = "circulate"
    ) -> Journey:
        """Send the car through lanes from where it is; on arrival it circulates or stops.

        Without lanes it circulates at once, and never arrives.

        Raises:
            ScmError: for a lane, a number of laps, a speed or a `then` that cannot be.
        """
        if then not in THEN:
            msg = f"then: got {then!r}, expected 'circulate' or 'stop'{nearest(then, THEN)}"
            raise ScmError(msg)
        if speed_mps is not None and not 0.0 < speed_mps < math.inf:
            msg = f"speed_mps: got {speed_mps}, expected above 0"
            raise ScmError(msg)
        request = RouteRequest(
            request_id=self.city.new_trip_id(self.name),
            vehicle=self.name,
            via=via,
            laps=laps,
            speed_mps=speed_mps,
            then="stop" if then == "stop" else "circulate",
        )
        return self.city.send(request)

    def park(self, goal: str) -> ParkReply:
        """Send the car to park at a spawn place, in a bay or `any` bay, or at `X,Y,DEG`.

        Returns at once. It finds its way itself, if `vehicle-agent park --vehicle NAME` runs.

        Raises:
            ScmError: without such an agent, or for a goal that is not on the map.
        """
        return self.city.request(ParkRequest(vehicle=self.name, goal=goal), ParkReply)

    def remove(self) -> None:
        """Remove the car from the map."""
        self.city.remove(self)


class City:
    """A city as a script controls it; cars that the script spawned leave with it."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._trip_numbers = itertools.count(1)
        self._may_arrive: dict[str, tuple[Journey, ...]] = {}  # by car: its last two journeys
        self._arrivals = link.subscribe(Subscription(Trip), self._is_arrival)
        self._disturbances = Disturbances()
        for kind in MESSAGE_KINDS:
            link.subscribe(Subscription(kind), self._watch)
        self.cars: list[FleetCar] = []

    @property
    def time_s(self) -> float:
        """The city's time [s]."""
        return seconds(self._link.now_ns)

    def spawn(self, car: str = "nigel", *, at: str = "", name: str = "") -> FleetCar:
        """Place a car at a spawn place of the map, at `X,Y,DEG`, or at the first free place."""
        reply = self.request(SpawnRequest(vehicle=name, car=car, spawn=at), SpawnReply)
        spawned = FleetCar(reply.vehicle, self)
        self.cars.append(spawned)
        return spawned

    def use_plan(self, plan: str, *, junction: str = "crossing", reason: str = "") -> PlanReply:
        """Request a signal plan; the kernel switches at the next safe moment."""
        request = PlanRequest(junction=junction, plan=plan, by=program_name(), reason=reason)
        return self.request(request, PlanReply)

    @property
    def disturbances(self) -> tuple[Disturbance, ...]:
        """What makes measurements void at this moment, the oldest first."""
        self._disturbances.check_silence(self._link.now_ns)
        return self._disturbances.now()

    def wait_for_disturbance(self, timeout_s: float = 120.0) -> Disturbance | None:
        """Let the city run until something makes measurements void; None if nothing does."""
        return self.disturbances[0] if self._run_until(self._is_disturbed, timeout_s) else None

    def wait_until_undisturbed(self, timeout_s: float = 120.0) -> None:
        """Let the city run until nothing makes measurements void any more.

        Raises:
            RunError: when the time is over, with what still does.
        """
        if not self._run_until(lambda: not self._is_disturbed(), timeout_s):
            still = "; ".join(one.text for one in self.disturbances)
            msg = f"after {timeout_s:g} s the city is still disturbed: {still}"
            raise RunError(msg)

    wait_for_calm = wait_until_undisturbed
    """Its name in 0.1, for scripts that call it."""

    def run_for(self, duration_s: float) -> None:
        """Let the city run for a while."""
        end = self._link.now_ns + round(duration_s * 1e9)
        self._run_until(lambda: self._link.now_ns >= end, duration_s + 1.0)

    def wait(self, journeys: Sequence[Journey], timeout_s: float = 120.0) -> None:
        """Let the city run until all journeys have arrived, void or not.

        Raises:
            RunError: when the time is over, or a journey can never arrive: its car circulates, or
                the script has removed it.
        """
        here = {car.name for car in self.cars}
        for journey in journeys:
            if journey.arrived_ns is None and (
                journey.length_m is None or journey.vehicle not in here
            ):
                why = "it was removed" if journey.vehicle not in here else "it circulates"
                msg = f"{journey.vehicle} will never arrive: {why}"
                raise RunError(msg)

        def late() -> list[str]:
            return [journey.vehicle for journey in journeys if journey.arrived_ns is None]

        if self._run_until(lambda: not late(), timeout_s):
            return
        msg = f"after {timeout_s:g} s these cars had not arrived: {', '.join(late())}"
        raise RunError(msg)

    def request(self, request: Request, kind: type[R]) -> R:
        """Send a request and return the reply.

        Raises:
            ScmError: when it is refused, with the reason.
        """
        reply = self._link.request(request)
        self._note_arrivals()
        if isinstance(reply, Refused):
            msg = f"{type(request).__name__}: {reply.detail}"
            raise ScmError(msg)
        if not isinstance(reply, kind):
            msg = f"{type(request).__name__}: got {type(reply).__name__}, expected {kind.__name__}"
            raise ScmError(msg)
        return reply

    def new_trip_id(self, vehicle: str) -> str:
        """Return a trip id that no car of this name has had before."""
        return f"{vehicle}-{self._link.now_ns}-{next(self._trip_numbers)}"

    def send(self, request: RouteRequest) -> Journey:
        """Send a car on a trip, named by the request's id; see `FleetCar.drive`.

        Raises:
            ScmError: when it is refused, with the reason.
        """
        journey = Journey(request.vehicle, request.request_id, self._disturbances)
        before = self._may_arrive.get(request.vehicle, ())
        # The arrival of the trip before may still be on its way here.
        self._may_arrive[request.vehicle] = (*before[-1:], journey)
        try:
            reply = self.request(request, RouteReply)
        except ScmError:
            self._may_arrive[request.vehicle] = before
            raise
        journey.route, journey.length_m = reply.route, reply.length_m
        return journey

    def remove(self, car: FleetCar) -> None:
        """Remove a car that the script has spawned."""
        self.request(RemoveRequest(vehicle=car.name, reason=f"{program_name()} is done"), Message)
        self.cars.remove(car)
        self._may_arrive.pop(car.name, None)

    def leave(self) -> None:
        """Remove every car that this script spawned, as far as the city allows it."""
        for car in list(self.cars):
            try:
                car.remove()
            except ScmError as cause:
                event(_log, "car_left_behind", level=logging.WARNING, car=car.name, reason=cause)

    def _run_until(self, done: Callable[[], bool], timeout_s: float) -> bool:
        def is_done() -> bool:
            self._note_arrivals()
            return done()

        return self._link.run_until(is_done, timeout_s)

    def _is_disturbed(self) -> bool:
        return bool(self.disturbances)

    def _watch(self, item: Incoming) -> bool:
        """Track disturbances as messages arrive; reject the message, so that none is stored."""
        self._disturbances.receive(item)
        return False

    def _is_arrival(self, item: Incoming) -> bool:
        """Return whether a message ends one of the script's journeys; on the bus's thread, live."""
        trip = item.message
        return isinstance(trip, Trip) and trip.arrived_ns is not None and self._of(trip) is not None

    def _of(self, trip: Trip) -> Journey | None:
        journeys = self._may_arrive.get(trip.vehicle, ())
        return next((one for one in journeys if one.trip_id == trip.trip_id), None)

    def _note_arrivals(self) -> None:
        for item in self._arrivals.drain():
            trip = item.message
            if isinstance(trip, Trip) and trip.arrived_ns is not None:
                journey = self._of(trip)
                if journey is not None:
                    journey.started_ns, journey.arrived_ns = trip.started_ns, trip.arrived_ns


@contextmanager
def open_city(
    map_name: str = "driving_school",
    *,
    connect: str | None = None,
    city: str = "city",
    seed: int = 0,
    credentials: Path | None = None,
) -> Iterator[City]:
    """Open a city for a script.

    Args:
        map_name: Which map to build in lockstep; ignored live: the city has its own.
        connect: Router of a running city; None: a city of its own, in lockstep.
        city: Name of the city on the bus.
        seed: Of all randomness in lockstep.
        credentials: File of an operator, for a guarded city; None: the
            one that `SCM_CREDENTIALS` names, as a city sets it for the scripts that it runs.
    """
    if connect is None:
        with _lockstep_city(map_name, city, seed) as lockstep:
            yield City(LockstepLink(lockstep))
        return
    given = credentials or os.environ.get("SCM_CREDENTIALS")
    who = read_credentials(Path(given)) if given else None
    with ZenohBus(city, "script", connect, credentials=who) as bus:
        live = City(LiveLink(bus))
        try:
            yield live
        finally:
            live.leave()


def _lockstep_city(map_name: str, city: str, seed: int) -> Lockstep:
    city_map = load_map(map_name)
    world = WorldPart(city_map, seed, city=city)
    parts: list[Part] = [world, TrafficPart(city_map), MonitorPart(city_map)]
    return Lockstep(parts, city)
