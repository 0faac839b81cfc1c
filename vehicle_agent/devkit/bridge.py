"""The part that connects one Devkit script to cars and lights of a city.

newest messages -> telemetry, read by the script's own thread whenever a packet is due
the script's newest reply -> drive commands under each car's lease, requests for lights, resets

While no script is connected the bridge subscribes to no scans, pictures or measurements and leases
no car. Only the newest message of each kind is stored.
"""

import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from scm.clock import NS_PER_MS, NS_PER_S, seconds
from scm.errors import CarError, RunError
from scm.log import event
from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Call, Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.remove_request import RemoveRequest
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import load_car
from vehicle_agent.devkit.commands import CarCommand, Commands, ScriptCommand, Sign
from vehicle_agent.devkit.cosim import CosimCar
from vehicle_agent.devkit.deflate import Packet
from vehicle_agent.devkit.heads import Heads
from vehicle_agent.devkit.telemetry import CAMERAS, Telemetry, Version
from vehicle_agent.lease import CarLease

MISSING_AFTER_NS = 2 * NS_PER_S  # without a report a car is not in the city
FIRST_PICTURE_TIMEOUT_NS = 10 * NS_PER_S  # a renderer loads its car before the first picture
SPAWN_RETRY_NS = NS_PER_S
SPAWN_TIMEOUT_S = 10.0
REQUEST_TIMEOUT_S = 1.0
UNKNOWN_CAR = "nigel"

_log = logging.getLogger(__name__)


class Script(Protocol):
    """The script as the bridge sees it: `ScriptSocket`, or a test's."""

    is_open: bool
    failure: Exception | None

    @property
    def detail(self) -> str:
        """State of the script, in words."""
        ...


@dataclass(frozen=True, slots=True)
class Wanted:
    """Configuration of a bridge.

    Attributes:
        cars: Vehicles, in the order of V1, V2...
        lights: Ids of lights, in the order of TL1, TL2...; empty: all, in the map's order.
        sign: Which way a steering of +1 turns.
        cameras: Which of `front` and `rear` have pictures; the others stay black. No packet is sent
            before the first picture of each, for at most 10 s.
        spawns: None: the cars exist. Else the bridge spawns them at these places, in the order of
            the cars; at any free place for the rest.
        cosim: Whether the script places the cars itself.
        car: Car file of the cars that it spawns.
        packet: Version of the simulator whose packets are sent.
    """

    cars: tuple[str, ...]
    lights: tuple[int, ...] = ()
    sign: Sign = "left"
    cameras: tuple[str, ...] = tuple(CAMERAS)
    spawns: tuple[str, ...] | None = None
    cosim: bool = False
    car: str = UNKNOWN_CAR
    packet: Version = "0.3"


class DevkitPart(BasePart):
    """The bridge; its script is set later, by `connect`.

    Args:
        name: Its station, which owns the leases.
        wanted: Its configuration.
        session: Of its bus.
    """

    role = "client"
    period_ns = 10 * NS_PER_MS

    def __init__(self, name: str, wanted: Wanted, session: str = "") -> None:
        self.name = name
        self._wanted = wanted
        self._defined_ns: int | None = None
        self._telemetry = Telemetry(wanted.cars, wanted.packet)
        self._commands = Commands(len(wanted.cars), wanted.sign)
        self._heads = Heads(name)
        self._leases = {car: CarLease(car, name) for car in wanted.cars}
        placed = wanted.cars if wanted.cosim else ()
        self._placed = {car: CosimCar(car, wanted.car, session) for car in placed}
        self._spawns = _Spawns(wanted, f"{name}-{session}")
        self._reply: tuple[ScriptCommand, int] | None = None
        self._resets: set[str] = set()
        self._resetting = [False] * len(wanted.cars)
        self._script: Script | None = None
        self._was_open = False
        self._blind_since_ns = 0
        self._may_lack_pictures = False
        self._seen_ns: dict[str, int] = {}
        self._warned: set[str] = set()
        self._replies = 0
        self._status_ns: int | None = None
        always = [Subscription(WorldDefinition), Subscription(Spat)]
        always += [Subscription(VehicleState, {"vehicle": car}) for car in wanted.cars]
        self._always = tuple(always)
        self.subscriptions: Sequence[Subscription] = self._always
        self._on_reply: dict[type[Message], Callable[[Any, Message, int], None]] = {
            LeaseRequest: self._leased,
            SignalRequest: lambda request, reply, _: self._heads.replied(request, reply),
            JoinRequest: lambda request, reply, _: self._placed[request.vehicle].replied(reply),
            SpawnRequest: lambda request, reply, _: self._spawns.spawned(request, reply),
            RemoveRequest: lambda request, *_: self._spawns.removed(request.vehicle),
        }

    def connect(self, script: Script) -> None:
        """Set the script."""
        self._script = script

    def packet(self) -> Packet | None:
        """Return the newest telemetry, None while there is none; called on the script's thread."""
        if not self._was_open or (not self._may_lack_pictures and self._unpictured):
            return None
        return self._telemetry.packet()

    def on_reply(self, data: Any, t_ns: int) -> None:
        """Process a reply of the script; called on the script's thread."""
        command = self._commands.read(data)
        for number, (car, car_command) in enumerate(
            zip(self._wanted.cars, command.cars, strict=True)
        ):
            if car_command.reset and not self._resetting[number]:
                self._resets.add(car)
            self._resetting[number] = car_command.reset
        self._replies += 1
        self._reply = command, t_ns

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Process messages of the city; send what the script requests."""
        for item in inbox:
            self._receive(item, now_ns)
        if self._script is not None and self._script.failure is not None:
            raise self._script.failure
        is_open = self._script is not None and self._script.is_open
        if is_open != self._was_open:
            self._open(is_open, now_ns)
        if is_open and not self._may_lack_pictures:
            self._wait_for_pictures(now_ns)
        out: list[Outgoing] = [*self._spawns.step(now_ns, self._missing(now_ns))]
        for placed in self._placed.values():
            out += self._placed_now(placed, now_ns)
        if not is_open:
            out += self._released()
        elif self._reply is not None:
            out += self._obey(*self._reply, now_ns)
        return out + self._status(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release all leases and requests, and remove spawned cars."""
        del now_ns
        out = self._released()
        for placed in self._placed.values():
            out += placed.leave()
        return [*out, *self._spawns.leave()]

    def _receive(self, item: Incoming, now_ns: int) -> None:
        message = item.message
        if item.call is not None:
            request = item.call.request
            self._on_reply[type(request)](request, message, now_ns)
        elif isinstance(message, WorldDefinition):
            if message.t_ns != self._defined_ns:
                self._defined_ns = message.t_ns
                self._learn(message.map)
        else:
            self._update_telemetry(message, now_ns)

    def _update_telemetry(self, message: Message, now_ns: int) -> None:
        if isinstance(message, VehicleState):
            self._seen_ns[message.vehicle] = now_ns
            if not self._telemetry.knows(message.vehicle, message.car):
                self._telemetry.add_car(message.vehicle, message.car, self._car(message.car))
        self._telemetry.update(message)

    def _placed_now(self, placed: CosimCar, now_ns: int) -> list[Outgoing]:
        """Report a placed car; its own reports update the telemetry directly."""
        out = placed.step(now_ns)
        for message in out:
            if isinstance(message, VehicleState):
                self._update_telemetry(message, now_ns)
        return out

    def _leased(self, request: LeaseRequest, reply: Message, now_ns: int) -> None:
        del now_ns
        self._leases[request.vehicle].replied(request, reply)

    def _car(self, name: str) -> Any:
        try:
            return load_car(name)
        except CarError as cause:
            self._warn_once(f"{cause}; a {UNKNOWN_CAR}'s camera, wheels and scanner are assumed")
            return load_car(UNKNOWN_CAR)

    def _learn(self, city_map: CityMap) -> None:
        by_id = {light.light_id: light for light in city_map.lights}
        ids = self._wanted.lights or tuple(by_id)
        unknown = [light_id for light_id in ids if light_id not in by_id]
        if unknown:
            known = ", ".join(str(light_id) for light_id in by_id) or "none"
            msg = f"--light {unknown[0]}: map {city_map.name} has no such light, only {known}"
            raise RunError(msg)
        heads = [(by_id[light_id].junction, by_id[light_id].group) for light_id in ids]
        self._telemetry.show_lights(heads)
        self._heads.learn(heads)
        self._commands.lights = len(heads)

    @property
    def _unpictured(self) -> list[str]:
        return self._telemetry.unpictured(self._wanted.cameras)

    def _wait_for_pictures(self, now_ns: int) -> None:
        """Allow packets without first pictures some time after the last car arrived."""
        if self._telemetry.unknown:
            self._blind_since_ns = now_ns
        if now_ns - self._blind_since_ns < FIRST_PICTURE_TIMEOUT_NS:
            return
        self._may_lack_pictures = True
        for one in self._unpictured:
            self._warn_once(
                f"{one}: no picture for 10 s, black until one comes; does `scm camera` run?"
            )

    def _open(self, is_open: bool, now_ns: int) -> None:
        """Change subscriptions when a script connects or leaves; discard its last reply."""
        self._telemetry.forget_views()
        self._blind_since_ns, self._reply = now_ns, None
        self._may_lack_pictures = (
            self._wanted.cosim
        )  # no camera sees a car before its script places it
        self._was_open = is_open
        self.subscriptions = (*self._always, *self._needed()) if is_open else self._always

    def _needed(self) -> list[Subscription]:
        out = []
        for car in self._wanted.cars:
            own = {"vehicle": car}
            out += [Subscription(VehicleSensors, own), Subscription(LidarScan, own)]
            out += [
                Subscription(CameraFrame, own | {"camera": name}) for name in self._wanted.cameras
            ]
        return out

    def _missing(self, now_ns: int) -> list[str]:
        gone = [
            car
            for car in self._wanted.cars
            if now_ns - self._seen_ns.setdefault(car, now_ns) > MISSING_AFTER_NS
        ]
        for car in gone:
            if not self._placed and self._wanted.spawns is None:
                self._warn_once(f"no car {car} in this city: no message for 2 s; see --spawn")
        return gone

    def _obey(self, command: ScriptCommand, replied_ns: int, now_ns: int) -> list[Outgoing]:
        out: list[Outgoing] = []
        for car, car_command in zip(self._wanted.cars, command.cars, strict=True):
            if car in self._placed:
                if car_command.pose is not None:
                    self._placed[car].place(car_command.pose, replied_ns)
            elif self._spawns.is_ready(car):
                out += self._leases[car].step(now_ns, self._driven(car, car_command), replied_ns)
        while self._resets:
            out += self._reset(self._resets.pop())
        return [*out, *self._heads.step(now_ns, command.lights)]

    def _driven(self, car: str, car_command: CarCommand) -> CarCommand:
        if car_command.pose is not None:
            self._warn_once(f"CoSim: {car} is driven, not placed: start the bridge with --cosim")
        return car_command

    def _reset(self, car: str) -> list[Outgoing]:
        calls = self._spawns.reset(car)
        if calls is None:
            self._warn_once(
                f"Reset: {car} was not spawned by this bridge, so it stays: see --spawn"
            )
            return []
        self._leases[car].forget()
        return list(calls)

    def _released(self) -> list[Outgoing]:
        out: list[Outgoing] = [call for lease in self._leases.values() for call in lease.release()]
        return [*out, *self._heads.release()]

    def _warn_once(self, what: str) -> None:
        if what not in self._warned:
            self._warned.add(what)
            event(_log, "devkit_refused", level=logging.WARNING, why=repr(what))

    def _status(self, now_ns: int) -> list[Outgoing]:
        since_ns = NS_PER_S if self._status_ns is None else now_ns - self._status_ns
        if since_ns < NS_PER_S:
            return []
        rate_hz, self._replies, self._status_ns = self._replies / seconds(since_ns), 0, now_ns
        script = "no script" if self._script is None else self._script.detail
        dark = [] if self._may_lack_pictures else self._unpictured
        awaited = [*self._telemetry.unknown, *(f"a picture of {one}" for one in dark)]
        waits = f", waits for {', '.join(awaited)}" if awaited else ""
        drivers = self._placed or self._leases
        cars = ", ".join(driver.detail for driver in drivers.values())
        detail = f"{script}{waits}; {cars}, {rate_hz:.0f} replies/s" if self._was_open else script
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]


class _Spawns:
    """The cars that a bridge spawns and resets to their places.

    A request without an answer is repeated under its id until it is answered: the car may be on the
    map already. Cars whose request was never answered are removed with the rest at the end.

    Args:
        wanted: Configuration of the bridge.
        run: Name of this bridge and its run.
    """

    def __init__(self, wanted: Wanted, run: str) -> None:
        self._car = wanted.car
        self._run = run
        self._numbers = itertools.count(1)
        self._pending_ids: dict[str, str] = {}  # by car: the request id
        self._places: dict[str, str] = {}
        self._requested_ns: int | None = None
        self._here: set[str] = set()
        self._brought: set[str] = set()
        self._present_before: set[str] = set()  # cars that existed before
        self._leaving: set[str] = set()
        self._last_refusal = ""
        if wanted.spawns is not None and not wanted.cosim:
            padded = (*wanted.spawns, *[""] * len(wanted.cars))
            self._places = dict(zip(wanted.cars, padded, strict=False))

    def is_ready(self, car: str) -> bool:
        """Whether it may be driven: it needs no spawn, or was spawned."""
        return car not in self._places or car in self._here

    def step(self, now_ns: int, absent: Sequence[str]) -> list[Call]:
        """Return the requests that spawn missing cars."""
        missing = [car for car in self._places if car not in self._here or car in absent]
        missing = [car for car in missing if car not in self._leaving]
        due = self._requested_ns is None or now_ns - self._requested_ns >= SPAWN_RETRY_NS
        if not missing or not due:
            return []
        self._requested_ns = now_ns
        return [Call(self._request(car), SPAWN_TIMEOUT_S) for car in missing]

    def _request(self, car: str) -> SpawnRequest:
        if car not in self._pending_ids:
            self._pending_ids[car] = f"{self._run}-{car}-{next(self._numbers)}"
        return SpawnRequest(
            request_id=self._pending_ids[car], vehicle=car, car=self._car, spawn=self._places[car]
        )

    def spawned(self, request: SpawnRequest, reply: Message) -> None:
        """Process the reply to a spawn request; a car that exists already is driven, not owned."""
        is_open = isinstance(reply, Refused) and reply.code in ("timeout", "offline")
        if not is_open and self._pending_ids.get(request.vehicle) == request.request_id:
            del self._pending_ids[request.vehicle]
        if isinstance(reply, SpawnReply):
            self._brought.add(request.vehicle)
            self._here.add(request.vehicle)
        elif isinstance(reply, Refused) and reply.code == "owned":
            self._here.add(request.vehicle)
            self._present_before.add(request.vehicle)
        elif isinstance(reply, Refused) and reply.detail != self._last_refusal:
            self._last_refusal = reply.detail
            event(_log, "devkit_spawn", level=logging.WARNING, why=repr(reply.detail))

    def reset(self, car: str) -> list[Call] | None:
        """Return the request that removes a car, to spawn it again; None if it is not ours."""
        if car not in self._brought:
            return None
        self._forget(car)
        self._leaving.add(car)
        return [Call(RemoveRequest(vehicle=car, reason="reset by its script"), REQUEST_TIMEOUT_S)]

    def removed(self, car: str) -> None:
        """Note that a car was removed: it may be spawned again at once."""
        self._leaving.discard(car)
        self._requested_ns = None

    def leave(self) -> list[Call]:
        """Return the requests that remove all cars that were spawned, or may have been."""
        cars = self._brought | (self._pending_ids.keys() - self._present_before)
        return [Call(RemoveRequest(vehicle=car), REQUEST_TIMEOUT_S) for car in sorted(cars)]

    def _forget(self, car: str) -> None:
        self._brought.discard(car)
        self._here.discard(car)
