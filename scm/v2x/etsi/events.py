"""Warnings: when a DENM is sent and ended, and how a receiver handles it.

    trigger   new action id, detected now; sent at once and repeated every interval
    update    same action id, later reference time, by the station that triggered it
    cancel    the same with termination 0; the action id is never used again
    negate    another station's event is over: its action id with termination 1
    valid     for validity_duration from the detection; then its sender stops

A receiver accepts of one action id only later reference times than the last; an equal one is a
repetition. A termination is final. A negation counts only for an event that the receiver knows.
Terminations are sent until the event would have expired.
Source: EN 302 637-3 v1.3.1, 6 and 8.
"""

import dataclasses
from dataclasses import dataclass
from typing import Literal, NamedTuple

from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MessageError
from scm.v2x.etsi.cam_spatem import PASSENGER_CAR
from scm.v2x.etsi.convert import heading_of, its_time, position_of, speed_of, station_id
from scm.v2x.etsi.denm import (
    CANCELLATION,
    NEGATION,
    ActionId,
    CauseCode,
    DenmBody,
    DenmLocation,
    DenmManagement,
    DenmSituation,
    EventPosition,
    Trace,
)
from scm.v2x.etsi.parts import PROTOCOL_VERSION, Heading
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.vehicle_state import VehicleState

ACCIDENT, STATIONARY_VEHICLE, DANGEROUS_SITUATION = 2, 94, 99
MULTI_VEHICLE_ACCIDENT, EMERGENCY_BRAKE = 1, 1
HARD_BRAKING_MPS2 = 2.0  # four times comfortable braking; drivers stop for a signal with 1.2
MIN_BRAKING_MPS = 0.05
BRAKING_EVERY_NS = 5 * NS_PER_S
COUNTS = 65_536
MAX_EVENTS = 4096
STANDSTILL_MPS = 0.02
STANDING_NS = 2 * NS_PER_S
RENEW_NS = 15 * NS_PER_S  # half the validity of a stationary vehicle's warning
HIT_EVERY_NS = 10 * NS_PER_S
WALL = "wall"

Reception = Literal["new", "update", "repetition", "ended", "ignored"]


class Event(NamedTuple):
    """The content of a warning.

    Attributes:
        cause, subcause: Of TS 102 894-2.
        x_m, y_m: Position, map frame.
        quality: From 1, a guess, to 7, certain.
        valid_s: Validity without an update.
        interval_ms: Between repetitions.
        awareness: Class of its range: 0 within 50 m of the enlarged city, 1 100 m ...
        yaw_rad, speed_mps: Of the event, if it moves.
    """

    cause: int
    x_m: float
    y_m: float
    subcause: int = 0
    quality: int = 5
    valid_s: int = 60
    interval_ms: int = 1000
    awareness: int = 1
    yaw_rad: float | None = None
    speed_mps: float | None = None


@dataclass(slots=True)
class SentDenm:
    """A warning that is repeated: how often, until when, and when next."""

    body: DenmBody
    interval_ns: int
    ends_ns: int
    next_ns: int


class WarningMemory(NamedTuple):
    """All that a `CarWarnings` remembers.

    Attributes:
        hit_ns, braked_ns: When the car warned of a hit, and of its braking.
        since_ns: Since when it stands where it should not.
        stands: The event of that, and when it was renewed.
        triggered: How many events it has had.
        sent: What it still sends.
    """

    hit_ns: int | None
    braked_ns: int | None
    since_ns: int | None
    stands: tuple[ActionId, int] | None
    triggered: int
    sent: tuple[SentDenm, ...]


class DenmSender:
    """The warnings of one station; call `due` at the shortest interval."""

    def __init__(self, station: str, station_type: int = PASSENGER_CAR, first: int = 0) -> None:
        """Start with the station's name and the number of its first event."""
        self._station = station_id(station)
        self._station_type = station_type
        self._count = first
        self._sent: dict[ActionId, SentDenm] = {}

    @property
    def memory(self) -> tuple[int, tuple[SentDenm, ...]]:
        """The number of its next event, and what it still sends; may be written."""
        return self._count, tuple(dataclasses.replace(one) for one in self._sent.values())

    @memory.setter
    def memory(self, value: tuple[int, tuple[SentDenm, ...]]) -> None:
        self._count, sent = value
        self._sent = {one.body.management_container.action_id: one for one in sent}

    def trigger(self, event: Event, now_ns: int) -> ActionId:
        """Start a warning; return its action id."""
        action = ActionId(
            originating_station_id=self._station, sequence_number=self._count % COUNTS
        )
        self._count += 1
        self._send(self._body(action, event, now_ns), event, now_ns)
        return action

    def update(self, action: ActionId, event: Event, now_ns: int) -> None:
        """Update an own event, which counts as detected now.

        Raises:
            MessageError: when it has expired or belongs to another station.
        """
        self._own(action)
        self._send(self._body(action, event, now_ns), event, now_ns)

    def cancel(self, action: ActionId, now_ns: int) -> None:
        """Cancel an own event.

        Raises:
            MessageError: when it has expired or belongs to another station.
        """
        sent = self._own(action)
        self._end(sent.body, CANCELLATION, sent.interval_ns, sent.ends_ns, now_ns)

    def negate(self, received: DenmBody, now_ns: int) -> None:
        """Negate another station's event, received as `received`."""
        management = received.management_container
        interval_ns = (management.transmission_interval or 1000) * NS_PER_MS
        self._end(received, NEGATION, interval_ns, now_ns + _left_ns(received, now_ns), now_ns)

    @property
    def is_busy(self) -> bool:
        """Whether there is something to send now or later."""
        return bool(self._sent)

    def due(self, now_ns: int) -> list[DenmBody]:
        """Return the DENMs that are due; they count as sent."""
        self._sent = {name: sent for name, sent in self._sent.items() if sent.ends_ns > now_ns}
        bodies = []
        for sent in self._sent.values():
            if sent.next_ns <= now_ns:
                sent.next_ns = now_ns + sent.interval_ns
                bodies.append(sent.body)
        return bodies

    def _own(self, action: ActionId) -> SentDenm:
        sent = self._sent.get(action)
        if sent is None or sent.body.management_container.termination is not None:
            msg = f"DENM: expected an event of this station that still lasts, got {action}"
            raise MessageError(msg)
        return sent

    def _send(self, body: DenmBody, event: Event, now_ns: int) -> None:
        self._sent[body.management_container.action_id] = SentDenm(
            body, event.interval_ms * NS_PER_MS, now_ns + event.valid_s * NS_PER_S, now_ns
        )

    def _end(
        self, body: DenmBody, termination: int, interval_ns: int, ends_ns: int, now_ns: int
    ) -> None:
        before = body.management_container
        management = replace(
            before,
            reference_time=max(its_time(now_ns), before.reference_time + 1),
            termination=termination,
            station_type=self._station_type,
        )
        ended = DenmBody(
            protocol_version=PROTOCOL_VERSION,
            station_id=self._station,
            management_container=management,
        )
        self._sent[before.action_id] = SentDenm(ended, interval_ns, ends_ns, now_ns)

    def _body(self, action: ActionId, event: Event, now_ns: int) -> DenmBody:
        place = position_of(event.x_m, event.y_m)
        known = self._sent.get(action)
        now = its_time(now_ns)
        if known is not None:  # two updates within a millisecond
            now = max(now, known.body.management_container.reference_time + 1)
        return DenmBody(
            protocol_version=PROTOCOL_VERSION,
            station_id=self._station,
            management_container=DenmManagement(
                action_id=action,
                detection_time=now,
                reference_time=now,
                event_position=EventPosition(latitude=place.latitude, longitude=place.longitude),
                awareness_distance=event.awareness,
                relevance_traffic_direction=0,
                validity_duration=event.valid_s,
                transmission_interval=event.interval_ms,
                station_type=self._station_type,
            ),
            situation_container=DenmSituation(
                information_quality=event.quality,
                event_type=CauseCode(cause=event.cause, subcause=event.subcause),
            ),
            location_container=DenmLocation(
                event_speed=None if event.speed_mps is None else speed_of(event.speed_mps),
                event_position_heading=None
                if event.yaw_rad is None
                else Heading(value=heading_of(event.yaw_rad)),
                detection_zones_to_event_position=(Trace(),),
            ),
        )


class DenmReceiver:
    """The events that a receiver knows; beyond 4096 the one that ends first is dropped."""

    def __init__(self) -> None:
        self._known: dict[ActionId, tuple[DenmBody, int]] = {}

    def receive(self, body: DenmBody, now_ns: int) -> Reception:
        """Handle a DENM that arrived now; return what it was to this receiver."""
        management = body.management_container
        action, known = management.action_id, self._known.get(management.action_id)
        left_ns = _left_ns(body, now_ns)
        if left_ns <= 0:
            return "ignored"
        if known is not None:
            before = known[0].management_container
            if management.reference_time < before.reference_time or before.termination is not None:
                return "ignored"
            if management.reference_time == before.reference_time:
                return "repetition"
        if not _may_send(body, is_known=known is not None):
            return "ignored"
        self._known[action] = body, now_ns + left_ns
        self._forget(now_ns)
        if management.termination is not None:
            return "ended"
        return "new" if known is None else "update"

    def events(self, now_ns: int) -> tuple[DenmBody, ...]:
        """Return the valid events, in the order of their first reception."""
        self._forget(now_ns)
        return tuple(
            body
            for body, _ in self._known.values()
            if body.management_container.termination is None
        )

    def _forget(self, now_ns: int) -> None:
        self._known = {name: one for name, one in self._known.items() if one[1] > now_ns}
        if len(self._known) > MAX_EVENTS:
            del self._known[min(self._known, key=lambda name: self._known[name][1])]


def _may_send(body: DenmBody, *, is_known: bool) -> bool:
    """Return whether the sender may send this: an own event, or a negation of another's."""
    management = body.management_container
    if management.termination == NEGATION:
        return is_known and body.station_id != management.action_id.originating_station_id
    return body.station_id == management.action_id.originating_station_id


def _left_ns(body: DenmBody, now_ns: int) -> int:
    """Return the remaining validity of a DENM received now [ns]."""
    management = body.management_container
    age_ns = (its_time(now_ns) - management.detection_time) * NS_PER_MS
    return management.validity_duration * NS_PER_S - age_ns


def accident(contact: Contact, state: VehicleState) -> Event:
    """Return the warning of a car that was hit: an accident at its place."""
    others = [name for name in contact.against if name != WALL]
    return Event(
        cause=ACCIDENT,
        subcause=MULTI_VEHICLE_ACCIDENT if others else 0,
        x_m=state.x_m,
        y_m=state.y_m,
        yaw_rad=state.yaw_rad,
        speed_mps=state.speed_mps,
        quality=7,
    )


def stationary(state: VehicleState) -> Event:
    """Return the warning of a car that stands though it should drive."""
    return Event(
        cause=STATIONARY_VEHICLE,
        x_m=state.x_m,
        y_m=state.y_m,
        yaw_rad=state.yaw_rad,
        speed_mps=0.0,
        valid_s=30,
    )


def hard_braking(state: VehicleState) -> Event:
    """Return the warning of a car that brakes hard."""
    return Event(
        cause=DANGEROUS_SITUATION,
        subcause=EMERGENCY_BRAKE,
        x_m=state.x_m,
        y_m=state.y_m,
        yaw_rad=state.yaw_rad,
        speed_mps=state.speed_mps,
        valid_s=2,
        interval_ms=100,
        awareness=1,
    )


def city_stop(x_m: float, y_m: float) -> Event:
    """Return the warning of a roadside station while the whole city is stopped."""
    return Event(cause=DANGEROUS_SITUATION, x_m=x_m, y_m=y_m, awareness=4, quality=7)


class CarWarnings:
    """The warnings of one car: hits and hard braking at once, and standing where it should not.

    By default it should not stand when its guard holds or stops it (`mode`). Waiting at a red
    signal is no event.
    """

    def __init__(self, vehicle: str) -> None:
        self._sender = DenmSender(vehicle)
        self._hit_ns: int | None = None
        self._braked_ns: int | None = None
        self._since_ns: int | None = None
        self._stands: tuple[ActionId, int] | None = None

    @property
    def memory(self) -> WarningMemory:
        """All that it remembers; write what another one read to go on with it."""
        own = (self._hit_ns, self._braked_ns, self._since_ns, self._stands)
        return WarningMemory(*own, *self._sender.memory)

    @memory.setter
    def memory(self, value: WarningMemory) -> None:
        self._hit_ns, self._braked_ns, self._since_ns, self._stands = value[:4]
        self._sender.memory = value.triggered, value.sent

    @property
    def is_busy(self) -> bool:
        """Whether it warns of something or is about to: `step` must be called again."""
        return self._sender.is_busy or self._since_ns is not None

    def step(
        self,
        state: VehicleState,
        contacts: tuple[Contact, ...] = (),
        *,
        is_stranded: bool | None = None,
        has_braked: bool | None = None,
    ) -> list[DenmBody]:
        """Return the DENMs that are due; call it at every report of the car.

        Args:
            state: Of the car now.
            contacts: New contacts since the last call.
            is_stranded: Whether it stands where it should not; None: by its guard's mode.
            has_braked: Whether it braked hard since the last call; None: by `state`, which may miss
                it, since a small car stops within a tenth of a second.
        """
        now_ns = state.t_ns
        for contact in contacts:
            if contact.against and (self._hit_ns is None or now_ns - self._hit_ns >= HIT_EVERY_NS):
                self._sender.trigger(accident(contact, state), now_ns)
                self._hit_ns = now_ns
        if has_braked is None:
            is_moving = state.speed_mps > MIN_BRAKING_MPS
            has_braked = is_moving and state.accel_mps2 <= -HARD_BRAKING_MPS2
        if has_braked and not contacts:
            self._brake(state)
        if is_stranded is None:
            is_stranded = state.mode in ("hold", "stop") and abs(state.speed_mps) < STANDSTILL_MPS
        self._stand(state, is_stranded=is_stranded)
        return self._sender.due(now_ns)

    def _brake(self, state: VehicleState) -> None:
        hit_ns, braked_ns = self._hit_ns, self._braked_ns
        was_hit = hit_ns is not None and state.t_ns - hit_ns < BRAKING_EVERY_NS
        has_warned = braked_ns is not None and state.t_ns - braked_ns < BRAKING_EVERY_NS
        if not was_hit and not has_warned:
            self._sender.trigger(hard_braking(state), state.t_ns)
            self._braked_ns = state.t_ns

    def _stand(self, state: VehicleState, *, is_stranded: bool) -> None:
        now_ns = state.t_ns
        if not is_stranded:
            self._since_ns = None
            if self._stands is not None:
                self._sender.cancel(self._stands[0], now_ns)
                self._stands = None
            return
        if self._since_ns is None:
            self._since_ns = now_ns
        if self._stands is None and now_ns - self._since_ns >= STANDING_NS:
            self._stands = self._sender.trigger(stationary(state), now_ns), now_ns
        elif self._stands is not None and now_ns - self._stands[1] >= RENEW_NS:
            self._sender.update(self._stands[0], stationary(state), now_ns)
            self._stands = self._stands[0], now_ns
