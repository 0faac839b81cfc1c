"""Cars are sent to where they decide whose a change is.

    open        somebody agrees, or the policy is to send cars when they are idle
    waiting     the car has no other goal, nobody drives it     -- RouteRequest -->
    under_way   it passes the place some times; then it goes on as before, or back to its lane
    driven      through, or decided meanwhile                   (failed: refused, too late, sent on)

A car is idle that circulates, or stands since it arrived. The request names the trip that it may
replace, so that a goal which the car got meanwhile wins. A drive that was under way when the part
ended is not begun again: the car ends it alone.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.errors import MapError
from scm.geometry import Pose2
from scm.maps.route import Roads, roads_of
from scm.records.twins import TwinChange, TwinDrive
from scm.twin.car import TwinCar
from scm.twin.drives import PENDING, Point, at
from scm.twin.versions import BY_TWIN
from scm.v2x.exchange import Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition

SendWhen = Literal["agreed", "idle"]
LAPS = 6  # passes of a place: more than the ten windows that count there
MOST_SENT = 3  # cars for one change, without an operator
LASTS_NS = 180 * NS_PER_S  # a drive at most
WAITS_NS, BUSY_NS = 300 * NS_PER_S, 60 * NS_PER_S  # for an idle car: agreed to; without an operator
TRIP_KNOWN_NS = 10 * NS_PER_S  # of a trip under way; a thousand cars report theirs every 5 s
BESIDE_M = 0.3  # from the middle of a lane to a point that it leads through
HEADINGS_DEG = (0.0, 90.0, 180.0, 270.0)


@dataclass(slots=True)
class _Errand:
    """A drive of a car that was requested.

    Attributes:
        of: Whose change it decides, and which: when that was noticed [ns].
        trip_id: Of the drive.
        before: What the car did before.
        home: Lane on which it stood; empty: it circulated.
        since_ns: On our clock.
    """

    of: tuple[str, int]
    trip_id: str
    before: Trip
    home: str
    since_ns: int


class Sending:
    """Sends cars of one city to where they decide.

    Args:
        when: `agreed`: when an operator agrees; `idle`: also without one.
    """

    def __init__(self, when: SendWhen = "agreed") -> None:
        self._is_automatic = when == "idle"
        self._roads: Roads | None = None
        self._trips: dict[str, tuple[Trip, int]] = {}
        self._states: dict[str, VehicleState] = {}
        self._errands: dict[str, _Errand] = {}
        self._refused: dict[tuple[str, int], set[str]] = {}

    def receive(self, message: Message, now_ns: int) -> None:
        """Store where cars are, what they do, and the map."""
        if isinstance(message, VehicleState):
            self._states[message.vehicle] = message
        elif isinstance(message, Trip):
            self._trips[message.vehicle] = message, now_ns
        elif isinstance(message, WorldDefinition):
            self._roads = roads_of(message.map)

    def forget(self, vehicle: str) -> None:
        """Remove a car that has left."""
        self._trips.pop(vehicle, None)
        self._states.pop(vehicle, None)

    def reach_for(self, of: str) -> Callable[[str, Point], bool]:
        """Return what says whether a car can be sent through a point, for a change of another."""
        refused = {name for (vehicle, _), names in self._refused.items() if vehicle == of
                   for name in names}  # fmt: skip
        return lambda vehicle, point: vehicle not in refused and bool(self._way(vehicle, point))

    def agree(self, car: TwinCar, request: TwinSendRequest) -> tuple[Message, list[Outgoing]]:
        """Let a car be sent that would decide a change; return the reply and what else to send."""
        found = [one for one in car.changes if one.drive is not None and one.drive.state == "open"]
        change = next((one for one in reversed(found) if _goes(one, request.send)), None)
        if change is None or change.drive is None:
            known = ", ".join(one.drive.vehicle for one in found if one.drive and one.drive.vehicle)
            detail = f"no change of {car.name} waits to be decided by {request.send!r}, "
            return Refused(code="not_found", detail=f"{detail}expected {known or 'none'}"), []
        if not car.remembers(change):
            detail = f"what {car.name} drove before it changed is forgotten: nothing would decide"
            return Refused(code="invalid", detail=detail), []
        if not self._is_needed(change.drive):
            detail = f"{request.send} drives about already: it needs no goal"
            return Refused(code="invalid", detail=detail), []
        out = self._now(car, change, state="waiting", by=request.by)
        return car.status(), out

    def step(self, cars: Mapping[str, TwinCar], now_ns: int) -> list[Outgoing]:
        """Send what waits and may go, and end what was driven, decided, or takes too long."""
        out, active = list[Outgoing](), set[tuple[str, int]]()
        for car in cars.values():
            for change in tuple(car.changes):
                if change.drive is None or change.drive.state not in ("open", *PENDING):
                    continue
                active.add((car.name, change.noticed_ns))
                out += self._advance(car, change, change.drive, now_ns)
        for vehicle, errand in tuple(self._errands.items()):
            if errand.of not in active:  # decided while it was requested, or the car has left
                out += self._release(vehicle)
        return out

    def reply(self, item: Incoming, cars: Mapping[str, TwinCar]) -> list[Outgoing]:
        """Take the answer of a car that was to be sent."""
        request = None if item.call is None else item.call.request
        if not isinstance(request, RouteRequest):
            return []
        errand = self._errands.get(request.vehicle)
        if errand is None or errand.trip_id != request.request_id:
            return []
        car, change = cars.get(errand.of[0]), None
        if car is not None:
            change = next((one for one in car.changes if one.noticed_ns == errand.of[1]), None)
        if car is None or change is None or change.drive is None:
            return []  # `step` ends it
        if isinstance(item.message, RouteReply):
            where = "on its way" if change.drive.x_m is None else f"through {at(change.drive)}"
            text = f"{request.vehicle} is sent {where}, to decide whose {car.name}'s change is"
            event = car.event("car_sent", text)
            return [*self._now(car, change, state="under_way", sent=change.drive.sent + 1), event]
        del self._errands[request.vehicle]
        self._refused.setdefault(errand.of, set()).add(request.vehicle)
        reason = item.message.detail if isinstance(item.message, Refused) else "no reply"
        return self._failed(car, change, reason)

    def _advance(
        self, car: TwinCar, change: TwinChange, drive: TwinDrive, now_ns: int
    ) -> list[Outgoing]:
        errand = self._errands.get(drive.vehicle)
        is_sent = errand is not None and errand.of == (car.name, change.noticed_ns)
        if drive.state == "under_way":
            return self._drive_on(car, change, errand if is_sent else None, now_ns)
        if drive.state == "waiting":  # for a car that is not idle, or that has not answered yet
            return [] if is_sent else self._wait(car, change, drive, now_ns)
        may_go = self._is_automatic and drive.sent < MOST_SENT and bool(drive.vehicle)
        if may_go and self._is_needed(drive) and car.remembers(change):
            return self._now(car, change, state="waiting", by=BY_TWIN)
        return []

    def _wait(
        self, car: TwinCar, change: TwinChange, drive: TwinDrive, now_ns: int
    ) -> list[Outgoing]:
        """Send a car once it is idle; not for ever."""
        reason = self._why_not(drive.vehicle, now_ns)
        if not reason:
            return self._send(car, change, drive, now_ns)
        if car.newest_ns - drive.t_ns > (BUSY_NS if drive.by == BY_TWIN else WAITS_NS):
            self._refused.setdefault((car.name, change.noticed_ns), set()).add(drive.vehicle)
            return self._failed(car, change, f"{drive.vehicle} was never idle: {reason}")
        return [] if reason == drive.reason else self._now(car, change, reason=reason)

    def _send(
        self, car: TwinCar, change: TwinChange, drive: TwinDrive, now_ns: int
    ) -> list[Outgoing]:
        vehicle, (before, _) = drive.vehicle, self._trips[drive.vehicle]
        home = self._lane_of(vehicle) if before.arrived_ns is not None else ""
        trip_id = f"twin-{car.name}-{vehicle}-{now_ns}"
        way: tuple[tuple[str, ...], int] | None = (), 1
        if drive.x_m is not None and drive.y_m is not None:
            way = self._way(vehicle, (drive.x_m, drive.y_m), home)
        if way is None:
            return self._failed(car, change, f"{vehicle} cannot get there from where it is")
        via, laps = way
        of = car.name, change.noticed_ns
        self._errands[vehicle] = _Errand(of, trip_id, before, home, now_ns)
        request = RouteRequest(
            request_id=trip_id, vehicle=vehicle, via=via, laps=laps, speed_mps=before.speed_mps,
            then="stop" if home and via else "circulate", replaces=before.trip_id,
        )  # fmt: skip
        return [*self._now(car, change, reason=""), Call(request)]

    def _drive_on(
        self, car: TwinCar, change: TwinChange, errand: _Errand | None, now_ns: int
    ) -> list[Outgoing]:
        """Return what ends a drive; nothing while it goes on."""
        vehicle = "" if change.drive is None else change.drive.vehicle
        is_over = errand is not None and now_ns - errand.since_ns > LASTS_NS
        trip, why_lost = self._trip_of(vehicle, errand, now_ns)
        if why_lost:
            self._errands.pop(vehicle, None)
            return self._failed(car, change, f"{vehicle} {why_lost}")
        if trip is not None and trip.arrived_ns is not None:
            del self._errands[vehicle]
            return self._now(car, change, state="driven")
        if change.cause != "undecided" or (is_over and _is_anywhere(change)):
            return [*self._release(vehicle), *self._now(car, change, state="driven")]
        if is_over:
            reason = f"{vehicle} was not through after {LASTS_NS // NS_PER_S} s"
            return [*self._release(vehicle), *self._failed(car, change, reason)]
        return []

    def _trip_of(
        self, vehicle: str, errand: _Errand | None, now_ns: int
    ) -> tuple[Trip | None, str]:
        """Return the trip of a drive, None before it is reported; and why it is lost, or empty."""
        trip, known_ns = self._trips.get(vehicle, (None, 0))
        if errand is None or trip is None:
            return None, "has left"
        if trip.trip_id != errand.trip_id:
            is_other = trip.started_ns > errand.since_ns
            return None, "was sent elsewhere meanwhile" if is_other else ""
        is_lost = trip.arrived_ns is None and now_ns - known_ns > TRIP_KNOWN_NS
        return trip, "was driven by somebody else" if is_lost else ""

    def _release(self, vehicle: str) -> list[Outgoing]:
        """Let a car go on as before; one that stood goes back to its lane, and stops at its end."""
        errand = self._errands.pop(vehicle)
        request = RouteRequest(
            request_id=f"{errand.trip_id}-back", vehicle=vehicle,
            via=(errand.home,) if errand.home else (), speed_mps=errand.before.speed_mps,
            then="stop" if errand.home else "circulate", replaces=errand.trip_id,
        )  # fmt: skip
        return [Call(request)]

    def _why_not(self, vehicle: str, now_ns: int) -> str:
        """Return why a car is not idle, in words; empty: it is."""
        trip, known_ns = self._trips.get(vehicle, (None, 0))
        state = self._states.get(vehicle)
        if state is None or trip is None:
            return f"{vehicle} reports no trip"
        has_arrived, is_lost = trip.arrived_ns is not None, now_ns - known_ns > TRIP_KNOWN_NS
        reasons = {
            f"{vehicle} is on such a drive already": vehicle in self._errands,
            f"somebody drives {vehicle}": state.command_age_ms is not None,
            f"{vehicle} is stopped": state.mode == "stop",
            f"{vehicle} has just arrived": has_arrived and trip.then != "stop",
            f"{vehicle} is on its way elsewhere": not has_arrived and trip.length_m is not None,
            f"somebody drove {vehicle}, and it stands since": not has_arrived and is_lost,
        }
        return next((reason for reason, is_so in reasons.items() if is_so), "")

    def _is_needed(self, drive: TwinDrive) -> bool:
        """Return whether a car has to be sent: one that circulates drives about by itself."""
        if drive.x_m is not None:
            return True
        trip, _ = self._trips.get(drive.vehicle, (None, 0))
        return trip is not None and (trip.arrived_ns is not None or trip.length_m is not None)

    def _way(
        self, vehicle: str, point: Point, home: str = ""
    ) -> tuple[tuple[str, ...], int] | None:
        """Return which lanes lead a car through a point, and how often; None: none does."""
        begin, roads = self._lane_of(vehicle), self._roads
        if not begin or roads is None:
            return None
        for lane in _lanes_at(roads, point):
            via = (lane, home) if home and home != lane else (lane,)
            for laps in (LAPS, 2):  # a lane on which it is counts as passed
                try:
                    roads.route(begin, via, laps)
                except MapError:
                    continue
                return via, laps
        return None

    def _lane_of(self, vehicle: str) -> str:
        """Return the lane that a car is on; empty: none, or it is not known."""
        state = self._states.get(vehicle)
        if state is None or self._roads is None:
            return ""
        found = self._roads.nearest(Pose2(state.x_m, state.y_m, state.yaw_rad))
        return "" if found is None else found.lane

    def _failed(self, car: TwinCar, change: TwinChange, reason: str) -> list[Outgoing]:
        return self._now(car, change, state="failed", reason=reason)

    def _now(self, car: TwinCar, change: TwinChange, **then: object) -> list[Outgoing]:
        """Replace a change's drive by what is known of it now."""
        if change.drive is None:
            return []
        drive = replace(change.drive, **{"reason": "", **then})
        if drive.state != change.drive.state:
            drive = replace(drive, t_ns=car.newest_ns)
        return car.change_drive(change, drive)


def _is_anywhere(change: TwinChange) -> bool:
    return change.drive is not None and change.drive.x_m is None


def _goes(change: TwinChange, vehicle: str) -> bool:
    return change.drive is not None and change.drive.vehicle == vehicle != ""


def _lanes_at(roads: Roads, point: Point) -> Iterable[str]:
    """Return the lanes that lead through a point, the nearest first."""
    poses = (Pose2(*point, math.radians(degrees)) for degrees in HEADINGS_DEG)
    found = {one.lane: abs(one.lateral) for one in map(roads.nearest, poses) if one is not None}
    return sorted((lane for lane, m in found.items() if m <= BESIDE_M), key=lambda one: found[one])
