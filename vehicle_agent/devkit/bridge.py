"""The part that ties one Devkit script to cars and lights of a city.

hear the newest -> telemetry, which the script's own thread takes whenever a packet is due
the script's newest reply -> drive commands by each car's lease, wishes for lights, resets

While no script is there the city is asked for no scans, pictures or measurements, and no car is
leased. Of everything only the newest is held.
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
from vehicle_agent.devkit.commands import CarWish, Commands, Sign, Wishes
from vehicle_agent.devkit.cosim import CosimCar
from vehicle_agent.devkit.deflate import Packet
from vehicle_agent.devkit.heads import Heads
from vehicle_agent.devkit.telemetry import CAMERAS, Telemetry, Version
from vehicle_agent.devkit.wheel import Wheel

ABSENT_NS = 2 * NS_PER_S
PICTURE_NS = 10 * NS_PER_S  # a renderer that is asked for its first picture loads its car first
SPAWN_AGAIN_NS = NS_PER_S
SPAWN_S = 10.0
ASK_S = 1.0
UNKNOWN_CAR = "nigel"

_log = logging.getLogger(__name__)


class Script(Protocol):
    """The script as the bridge sees it: `ScriptSocket`, or a test's."""

    is_open: bool
    failure: Exception | None

    @property
    def detail(self) -> str:
        """How it stands with the script, in words."""
        ...


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a bridge is asked to do.

    Attributes:
        cars: Vehicles, in the order of V1, V2...
        lights: Ids of lights, in the order of TL1, TL2...; empty: all, in the map's order.
        sign: Which way a steering of +1 turns.
        cameras: Which of `front` and `rear` are pictured; the others stay black. No packet goes
            before the first picture of each, for 10 s at most.
        spawns: Whether the bridge brings the cars: None: they are there; else the places where
            they begin, in the order of the cars, any free one for those beyond.
        cosim: Whether the script places the cars itself.
        car: Car file of those that it brings.
        packet: Of which version of the simulator.
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
    """The bridge; its script is given to it later, by `meet`.

    Args:
        name: Its station, which owns the leases.
        wanted: What it does.
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
        self._wheels = {car: Wheel(car, name) for car in wanted.cars}
        placed = wanted.cars if wanted.cosim else ()
        self._placed = {car: CosimCar(car, wanted.car, session) for car in placed}
        self._spawns = _Spawns(wanted, f"{name}-{session}")
        self._said: tuple[Wishes, int] | None = None
        self._resets: set[str] = set()
        self._resetting = [False] * len(wanted.cars)
        self._script: Script | None = None
        self._was_open = False
        self._blind_since_ns = 0
        self._may_be_dark = False
        self._heard_ns: dict[str, int] = {}
        self._told: set[str] = set()
        self._replies = 0
        self._status_ns: int | None = None
        always = [Subscription(WorldDefinition), Subscription(Spat)]
        always += [Subscription(VehicleState, {"vehicle": car}) for car in wanted.cars]
        self._always = tuple(always)
        self.subscriptions: Sequence[Subscription] = self._always
        self._on_reply: dict[type[Message], Callable[[Any, Message, int], None]] = {
            LeaseRequest: self._leased,
            SignalRequest: lambda asked, reply, _: self._heads.replied(asked, reply),
            JoinRequest: lambda asked, reply, _: self._placed[asked.vehicle].replied(reply),
            SpawnRequest: lambda asked, reply, _: self._spawns.spawned(asked, reply),
            RemoveRequest: lambda asked, *_: self._spawns.removed(asked.vehicle),
        }

    def meet(self, script: Script) -> None:
        """Be given the script."""
        self._script = script

    def packet(self) -> Packet | None:
        """Return the newest telemetry, None while there is none; called on the script's thread."""
        if not self._was_open or (not self._may_be_dark and self._unpictured):
            return None
        return self._telemetry.packet()

    def said(self, data: Any, t_ns: int) -> None:
        """Take what the script says; called on the script's thread."""
        wishes = self._commands.read(data)
        for number, (car, wish) in enumerate(zip(self._wanted.cars, wishes.cars, strict=True)):
            if wish.reset and not self._resetting[number]:
                self._resets.add(car)
            self._resetting[number] = wish.reset
        self._replies += 1
        self._said = wishes, t_ns

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Hear the city; send what the script wants."""
        for item in inbox:
            self._hear(item, now_ns)
        if self._script is not None and self._script.failure is not None:
            raise self._script.failure
        is_open = self._script is not None and self._script.is_open
        if is_open != self._was_open:
            self._open(is_open, now_ns)
        if is_open and not self._may_be_dark:
            self._wait_for_pictures(now_ns)
        out: list[Outgoing] = [*self._spawns.step(now_ns, self._absent(now_ns))]
        for placed in self._placed.values():
            out += self._placed_now(placed, now_ns)
        if not is_open:
            out += self._released()
        elif self._said is not None:
            out += self._obey(*self._said, now_ns)
        return out + self._status(now_ns)

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Give everything back."""
        del now_ns
        out = self._released()
        for placed in self._placed.values():
            out += placed.leave()
        return [*out, *self._spawns.leave()]

    def _hear(self, item: Incoming, now_ns: int) -> None:
        message = item.message
        if item.call is not None:
            asked = item.call.request
            self._on_reply[type(asked)](asked, message, now_ns)
        elif isinstance(message, WorldDefinition):
            if message.t_ns != self._defined_ns:
                self._defined_ns = message.t_ns
                self._learn(message.map)
        else:
            self._tell_script(message, now_ns)

    def _tell_script(self, message: Message, now_ns: int) -> None:
        if isinstance(message, VehicleState):
            self._heard_ns[message.vehicle] = now_ns
            if not self._telemetry.knows(message.vehicle, message.car):
                self._telemetry.welcome(message.vehicle, message.car, self._car(message.car))
        self._telemetry.hear(message)

    def _placed_now(self, placed: CosimCar, now_ns: int) -> list[Outgoing]:
        """Let a placed car report; what is said of it is known without the city's telling."""
        out = placed.step(now_ns)
        for said in out:
            if isinstance(said, VehicleState):
                self._tell_script(said, now_ns)
        return out

    def _leased(self, asked: LeaseRequest, reply: Message, now_ns: int) -> None:
        del now_ns
        self._wheels[asked.vehicle].replied(asked, reply)

    def _car(self, name: str) -> Any:
        try:
            return load_car(name)
        except CarError as cause:
            self._tell(f"{cause}; its camera, wheels and scanner are taken for a {UNKNOWN_CAR}'s")
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
        """Let packets go without first pictures once these are late; count from the last car on."""
        if self._telemetry.unknown:
            self._blind_since_ns = now_ns
        if now_ns - self._blind_since_ns < PICTURE_NS:
            return
        self._may_be_dark = True
        for one in self._unpictured:
            self._tell(f"{one}: no picture for 10 s, black until one comes; does `scm camera` run?")

    def _open(self, is_open: bool, now_ns: int) -> None:
        """A script came or went: hear what it needs, or no more of it; forget what was said."""
        self._telemetry.forget_views()
        self._blind_since_ns, self._said = now_ns, None
        self._may_be_dark = self._wanted.cosim  # its script places a car before anything sees it
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

    def _absent(self, now_ns: int) -> list[str]:
        gone = [
            car
            for car in self._wanted.cars
            if now_ns - self._heard_ns.setdefault(car, now_ns) > ABSENT_NS
        ]
        for car in gone:
            if not self._placed and self._wanted.spawns is None:
                self._tell(f"no car {car} in this city: it was not heard for 2 s; see --spawn")
        return gone

    def _obey(self, wishes: Wishes, said_ns: int, now_ns: int) -> list[Outgoing]:
        out: list[Outgoing] = []
        for car, wish in zip(self._wanted.cars, wishes.cars, strict=True):
            if car in self._placed:
                if wish.pose is not None:
                    self._placed[car].place(wish.pose, said_ns)
            elif self._spawns.is_ready(car):
                out += self._wheels[car].step(now_ns, self._driven(car, wish), said_ns)
        while self._resets:
            out += self._reset(self._resets.pop())
        return [*out, *self._heads.step(now_ns, wishes.lights)]

    def _driven(self, car: str, wish: CarWish) -> CarWish:
        if wish.pose is not None:
            self._tell(f"CoSim: {car} is driven, not placed: start the bridge with --cosim")
        return wish

    def _reset(self, car: str) -> list[Outgoing]:
        calls = self._spawns.reset(car)
        if calls is None:
            self._tell(f"Reset: {car} was not brought by this bridge, so it stays: see --spawn")
            return []
        self._wheels[car].forget()
        return list(calls)

    def _released(self) -> list[Outgoing]:
        out: list[Outgoing] = [call for wheel in self._wheels.values() for call in wheel.release()]
        return [*out, *self._heads.release()]

    def _tell(self, what: str) -> None:
        if what not in self._told:
            self._told.add(what)
            event(_log, "devkit_refused", level=logging.WARNING, why=repr(what))

    def _status(self, now_ns: int) -> list[Outgoing]:
        since_ns = NS_PER_S if self._status_ns is None else now_ns - self._status_ns
        if since_ns < NS_PER_S:
            return []
        rate_hz, self._replies, self._status_ns = self._replies / seconds(since_ns), 0, now_ns
        script = "no script" if self._script is None else self._script.detail
        dark = [] if self._may_be_dark else self._unpictured
        awaited = [*self._telemetry.unknown, *(f"a picture of {one}" for one in dark)]
        waits = f", waits for {', '.join(awaited)}" if awaited else ""
        drivers = self._placed or self._wheels
        cars = ", ".join(driver.detail for driver in drivers.values())
        detail = f"{script}{waits}; {cars}, {rate_hz:.0f} replies/s" if self._was_open else script
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]


class _Spawns:
    """The cars that a bridge brings, and puts back to their places.

    A request whose answer does not come is asked again under its id until it is answered: the car
    may be on the map already. What was never answered is taken away with the rest at the end.

    Args:
        wanted: What the bridge does.
        run: Which bridge this is, and which run of it.
    """

    def __init__(self, wanted: Wanted, run: str) -> None:
        self._car = wanted.car
        self._run = run
        self._numbers = itertools.count(1)
        self._asking: dict[str, str] = {}  # by car: the request id
        self._places: dict[str, str] = {}
        self._asked_ns: int | None = None
        self._here: set[str] = set()
        self._ours: set[str] = set()
        self._others: set[str] = set()  # those that were there before
        self._going: set[str] = set()
        self._why = ""
        if wanted.spawns is not None and not wanted.cosim:
            padded = (*wanted.spawns, *[""] * len(wanted.cars))
            self._places = dict(zip(wanted.cars, padded, strict=False))

    def is_ready(self, car: str) -> bool:
        """Whether it may be driven: it need not be brought, or was."""
        return car not in self._places or car in self._here

    def step(self, now_ns: int, absent: Sequence[str]) -> list[Call]:
        """Return what brings those that are not there."""
        missing = [car for car in self._places if car not in self._here or car in absent]
        missing = [car for car in missing if car not in self._going]
        due = self._asked_ns is None or now_ns - self._asked_ns >= SPAWN_AGAIN_NS
        if not missing or not due:
            return []
        self._asked_ns = now_ns
        return [Call(self._request(car), SPAWN_S) for car in missing]

    def _request(self, car: str) -> SpawnRequest:
        if car not in self._asking:
            self._asking[car] = f"{self._run}-{car}-{next(self._numbers)}"
        return SpawnRequest(
            request_id=self._asking[car], vehicle=car, car=self._car, spawn=self._places[car]
        )

    def spawned(self, asked: SpawnRequest, reply: Message) -> None:
        """Hear what became of bringing a car; one that is there already is driven, not ours."""
        is_open = isinstance(reply, Refused) and reply.code in ("timeout", "offline")
        if not is_open and self._asking.get(asked.vehicle) == asked.request_id:
            del self._asking[asked.vehicle]
        if isinstance(reply, SpawnReply):
            self._ours.add(asked.vehicle)
            self._here.add(asked.vehicle)
        elif isinstance(reply, Refused) and reply.code == "owned":
            self._here.add(asked.vehicle)
            self._others.add(asked.vehicle)
        elif isinstance(reply, Refused) and reply.detail != self._why:
            self._why = reply.detail
            event(_log, "devkit_spawn", level=logging.WARNING, why=repr(reply.detail))

    def reset(self, car: str) -> list[Call] | None:
        """Return what takes a car off the map, for it to come back; None: it is not ours."""
        if car not in self._ours:
            return None
        self._forget(car)
        self._going.add(car)
        return [Call(RemoveRequest(vehicle=car, reason="reset by its script"), ASK_S)]

    def removed(self, car: str) -> None:
        """Hear that a car is off the map: it may come back at once."""
        self._going.discard(car)
        self._asked_ns = None

    def leave(self) -> list[Call]:
        """Return what takes away all that were brought, or may have been."""
        cars = self._ours | (self._asking.keys() - self._others)
        return [Call(RemoveRequest(vehicle=car), ASK_S) for car in sorted(cars)]

    def _forget(self, car: str) -> None:
        self._ours.discard(car)
        self._here.discard(car)
