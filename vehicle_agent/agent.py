"""The agent of one car as a part: messages go to its link, its sensors, its guard.

The car's own driver commands it until somebody with a newer lease does. Every command passes the
guard last.
"""

import logging
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from scm import registry
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import LeaseError, MapError, RunError
from scm.log import event
from scm.records.city_map import CityMap
from scm.runtime.part import IsWanted, Service, Subscription
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.key import check_name
from scm.v2x.message import Message, Refused
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.denm import DenmRx
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.echo_request import EchoReply, EchoRequest
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.radio_status import RadioStatus
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.world_definition import WorldDefinition
from vehicle_agent.body import BodyKind, Wiring
from vehicle_agent.link import Link

if TYPE_CHECKING:
    from vehicle_agent.session import CitySession

BODIES = "vehicle_agent.bodies"
MAX_CONTACT_CHANGE = 100.0  # m/s, rad/s, m and rad alike; beyond: a broken message
SUBSCRIBER_CHECK_NS = 100 * NS_PER_MS

_log = logging.getLogger(__name__)


def is_possible(contact: Contact) -> bool:
    """Return whether a contact is plausible: one absurd number would throw the car off the map."""
    hit = (contact.dvx_mps, contact.dvy_mps, contact.dyaw_rate_radps)
    shift = (contact.dx_m, contact.dy_m, contact.dyaw_rad)
    return all(abs(change) <= MAX_CONTACT_CHANGE for change in (*hit, *shift))


class AgentPart:
    """One car and its program."""

    role = "v"
    period_ns = 20 * NS_PER_MS

    def __init__(
        self,
        name: str,
        car: str = "nigel",
        spawn: str = "",
        session: str = "",
        seed: int = 0,
        body: str | BodyKind = "simulated",
        wiring: Wiring | None = None,
        tag_id: int | None = None,
    ) -> None:
        """Prepare to join.

        Args:
            name: Of the vehicle.
            car: Car file's name.
            spawn: Spawn place or `X,Y,DEG`; empty: any free one.
            session: Of the agent's bus; empty: learned from its own presence on the bus.
            seed: Of the sensors' noise.
            body: Kind of body, or the name of one: a file of `vehicle_agent/bodies`.
            wiring: How a real body is connected, and what it may do.
            tag_id: Of the tag on its roof; None: the city assigns one.
        """
        self.name = check_name(name, "vehicle")
        if isinstance(body, str):
            body = registry.load(BODIES, body, "BODY", BodyKind, RunError)
        self._wiring, self._is_real = wiring or Wiring(), body.kind == "real"
        self._body = body.open(car, seed, self._wiring)
        self._link = Link(name, car, body.kind, spawn, session, tag_id)
        self._car = car
        self._map: CityMap | None = None
        self._defined_ns: int | None = None
        self._session: CitySession | None = None
        self._twin: TwinStatus | None = None
        self._stopped = False
        self._faults = dict[str, MonitorStatus]()
        self._status_ns: int | None = None
        self._is_wanted: IsWanted | None = None
        self._is_sensing, self._checked_ns = True, -SUBSCRIBER_CHECK_NS
        self._on: dict[type[Message], Callable[[Incoming], list[Outgoing]]] = {
            WorldDefinition: self._on_definition,
            Presence: self._on_presence,
            SpatemRx: self._on_spatem,
            CamRx: self._on_cam,
            DenmRx: self._on_denm,
            MonitorStatus: self._on_monitor,
            RadioStatus: self._on_radio,
            CityStop: self._on_stop,
            Contact: self._on_contact,
            DriveCommand: self._on_command,
            RouteRequest: self._on_route,
            LightRequest: self._on_lights,
            EchoRequest: self._on_echo,
            EyeTrack: self._on_eye,
            TwinStatus: self._on_twin,
        }
        self.subscriptions: Sequence[Subscription] = self._subscriptions()
        served = (RouteRequest, LightRequest, EchoRequest)
        self.services = tuple(Service(kind, {"vehicle": name}) for kind in served)

    def attach(self, is_wanted: IsWanted) -> None:
        """Simulate from now on only sensors that somebody subscribes to."""
        self._is_wanted = is_wanted

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Receive, drive, report; on a failure the body is released before the error propagates."""
        try:
            return self._stepped(now_ns, inbox)
        except Exception:
            self._body.close()
            raise

    def _stepped(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        outbox: list[Outgoing] = []
        for item in inbox:
            if item.call is not None:
                self._on_reply(item, now_ns)
            elif type(item.message) in self._on:
                outbox += self._on[type(item.message)](item)
        self._check_losses(now_ns)
        if self._map is not None:
            outbox += self._link.due(now_ns)
        if self._session is not None:
            own = self._link.epoch if self._link.standing == "own" else None
            outbox += self._session.step(now_ns, own, sensed=self._is_sensed(now_ns))
        elif self._is_real:  # opens its port at once, and stands from the first second
            self._body.advance(now_ns)
            self._body.command(0.0, 0.0)
        return outbox + self._status(now_ns)

    def _is_sensed(self, now_ns: int) -> bool:
        """Return whether anybody subscribes to the sensors; checked every 100 ms."""
        if self._is_wanted is not None and now_ns - self._checked_ns >= SUBSCRIBER_CHECK_NS:
            self._checked_ns = now_ns
            self._is_sensing = self._is_wanted(VehicleSensors, {"vehicle": self.name})
        return self._is_sensing

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Leave the city, at rest."""
        self._body.command(0.0, 0.0)
        return [*self._link.goodbye()]

    def close(self) -> None:
        """Release the body, however the agent ends."""
        self._body.close()

    def _subscriptions(self) -> Sequence[Subscription]:
        here, own = {"receiver": self.name}, {"vehicle": self.name}
        return (
            Subscription(WorldDefinition),
            Subscription(Presence, {"role": self.role, "station": self.name}),
            Subscription(SpatemRx, here),
            Subscription(CamRx, here),
            Subscription(DenmRx, here),
            Subscription(MonitorStatus),
            Subscription(RadioStatus),
            Subscription(CityStop),
            Subscription(Contact, own),
            Subscription(DriveCommand, own),
            Subscription(TwinStatus, own),
            *([Subscription(EyeTrack, own)] if self._body.wants_eye else []),
        )

    def _check_losses(self, now_ns: int) -> None:
        if self._session is None:
            return
        if not self._link.is_inside:
            self._body.command(0.0, 0.0)
            self._session = None
        elif self._link.standing == "own" and (
            self._session.guard.lost or not self._link.is_alive(now_ns)
        ):
            self._link.regain()

    def _on_reply(self, item: Incoming, now_ns: int) -> None:
        was_own = self._link.standing == "own"
        came_in = self._link.accept_reply(item)
        if came_in and self._map is not None:
            self._body.place(self._link.start, now_ns)
            self._begin_session(self._map, now_ns)
        elif self._session is not None and self._link.standing == "own":
            self._session.guard.set_epoch(self._link.epoch, now_ns)
        elif self._session is not None and was_own and self._link.standing == "foreign":
            self._session.guard.set_epoch(self._link.epoch + 1, now_ns)  # its holder may command

    def _begin_session(self, city_map: CityMap, now_ns: int) -> None:
        from vehicle_agent.session import CitySession  # noqa: PLC0415 loads the compiler

        body, real = self._body, None
        if self._is_real:
            from vehicle_agent.actuation import real_guard  # noqa: PLC0415

            real = real_guard(body.limits, city_map, self._wiring)
        session = CitySession(self.name, self._car, body, city_map, self._link.epoch, now_ns, real)
        if session.trips.off_lane:
            event(_log, "cannot_drive", reason=session.trips.off_lane)
        session.guard.stop(self._stopped)
        if self._twin is not None:
            session.follow(self._twin)
        for status in self._faults.values():
            session.signals.receive_monitor_status(status)
        self._session = session

    def _on_definition(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if isinstance(message, WorldDefinition) and message.t_ns != self._defined_ns:
            self._defined_ns, self._map = message.t_ns, message.map
            self._body.learn(message.map, message.seed)
            if self._link.is_inside:
                self._link.leave("the world began anew")
        return []

    def _on_presence(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if isinstance(message, Presence) and message.alive and not self._link.session:
            self._link.session = message.session
        return []

    def _on_spatem(self, item: Incoming) -> list[Outgoing]:
        if isinstance(item.message, SpatemRx) and self._session is not None:
            self._session.signals.receive_spatem(item.message.body, item.t_ns)
            self._session.channel.add_frame("spatem", item.t_ns)
        return []

    def _on_cam(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if (
            isinstance(message, CamRx)
            and self._session is not None
            and message.station != self.name
        ):
            self._session.cars.receive(message.body, item.t_ns)
            self._session.channel.add_frame("cam", item.t_ns)
        return []

    def _on_denm(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if (
            isinstance(message, DenmRx)
            and self._session is not None
            and message.station != self.name
        ):
            self._session.trips.driver.batch.receive_denm(message.body, item.t_ns)
            self._session.channel.add_frame("denm", item.t_ns)
        return []

    def _on_radio(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if isinstance(message, RadioStatus) and self._session is not None:
            busy_by_station = dict(zip(message.stations, message.busy, strict=False))
            if self.name in busy_by_station:
                self._session.channel.set_ratio(busy_by_station[self.name], item.t_ns)
        return []

    def _on_monitor(self, item: Incoming) -> list[Outgoing]:
        if isinstance(item.message, MonitorStatus):
            self._faults[item.message.junction] = item.message
            if self._session is not None:
                self._session.signals.receive_monitor_status(item.message)
        return []

    def _on_twin(self, item: Incoming) -> list[Outgoing]:
        if isinstance(item.message, TwinStatus):
            self._twin = item.message
            text = "" if self._session is None else self._session.follow(item.message)
            if text:
                changed = CityEvent(
                    severity="warning", source=self.name, t_ns=item.t_ns, name="limits_changed",
                    text=text, vehicle=self.name,
                )  # fmt: skip
                return [changed]
        return []

    def _on_stop(self, item: Incoming) -> list[Outgoing]:
        if isinstance(item.message, CityStop):
            self._stopped = item.message.engaged
            if self._session is not None:
                self._session.guard.stop(self._stopped)
        return []

    def _on_contact(self, item: Incoming) -> list[Outgoing]:
        contact = item.message
        if isinstance(contact, Contact) and self._session is not None and is_possible(contact):
            self._session.push(contact)
        return []

    def _on_command(self, item: Incoming) -> list[Outgoing]:
        message = item.message
        if isinstance(message, DriveCommand) and self._session is not None:
            newer = message.epoch > self._link.epoch
            if newer and self._session.guard.accept(message, item.t_ns):
                self._session.switch_lights(message.headlights, message.indicators)
                self._link.give_way()
        return []

    def _on_eye(self, item: Incoming) -> list[Outgoing]:
        if isinstance(item.message, EyeTrack) and self._session is not None:
            self._session.see(item.message, item.t_ns)
        return []

    def _on_route(self, item: Incoming) -> list[Outgoing]:
        request = item.message
        if not isinstance(request, RouteRequest):
            return []
        return [Answer(item, self._route(request, item.t_ns))]

    def _route(self, request: RouteRequest, now_ns: int) -> Message:
        if self._session is None:
            return Refused(code="offline", detail=f"{self.name} is not in the city")
        is_foreign = self._link.standing == "foreign"
        is_commanded = is_foreign and self._session.guard.output(now_ns).mode in ("drive", "hold")
        if is_commanded or (is_foreign and request.replaces):
            return Refused(code="owned", detail=f"{self.name} is driven by somebody else")
        try:
            reply = self._session.begin(request, now_ns)
        except MapError as error:
            return Refused(code="invalid", detail=str(error))
        except LeaseError as error:
            return Refused(code="owned", detail=f"{self.name}: {error}")
        if is_foreign:
            self._link.regain()  # a car without a route stands still
        return reply

    def _on_lights(self, item: Incoming) -> list[Outgoing]:
        request = item.message
        if not isinstance(request, LightRequest):
            return []
        return [Answer(item, self._lights(request))]

    def _lights(self, request: LightRequest) -> Message:
        if self._session is None:
            return Refused(code="offline", detail=f"{self.name} is not in the city")
        if self._link.standing == "foreign":
            return Refused(code="owned", detail=f"{self.name} is driven by somebody else")
        switches = self._session.switch_lights(request.headlights, request.indicators)
        return LightReply(
            vehicle=self.name, headlights=switches.headlights, indicators=switches.indicators
        )

    def _on_echo(self, item: Incoming) -> list[Outgoing]:
        return [Answer(item, EchoReply(vehicle=self.name, t_ns=item.t_ns))]

    def _status(self, now_ns: int) -> list[Outgoing]:
        if self._status_ns is not None and now_ns - self._status_ns < NS_PER_S:
            return []
        self._status_ns = now_ns
        return [PartStatus(station=self.name, t_ns=now_ns, detail=self._detail())]

    def _detail(self) -> str:
        if self._session is None:
            return f"outside: {self._link.reason}" if self._map else "waits for the world"
        gate = self._session.gate
        if gate.why:
            return f"{gate.why} ({gate.summary})" if self._is_real else gate.why
        if self._link.standing == "foreign":
            return "driven by somebody else"
        if self._link.standing == "regaining":
            return "requests its lease"
        waiting = self._session.trips.driver.waiting_for
        return f"waits for {waiting}" if waiting else "drives"
