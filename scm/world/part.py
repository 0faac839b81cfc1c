"""The world as a part of the city: its inbox goes into a tick, what the tick sends comes out."""

from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.errors import RunError, ScmError
from scm.records.city_map import CityMap, Spawn
from scm.runtime.part import BasePart, IsWanted, Service, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.handover_request import HandoverRequest
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_definition import WorldDefinition
from scm.world.alerts import NAME, city_event
from scm.world.border_state import MAX_GHOSTS
from scm.world.driving import send
from scm.world.hosted import ELSEWHERE, HostedCar
from scm.world.reception import subscriptions_of
from scm.world.requests import SERVICES, reply_to
from scm.world.restore import RestoredState, restore
from scm.world.step import tick
from scm.world.world import DEFAULT_CAR, PERIOD_NS, World

ROOM = 256  # cars that may come later
DEFINITION_EVERY_NS = 10 * NS_PER_S
"""Interval at which the definition of the city is published again: the bus stores it for late
joiners, but on rare occasions one of them gets no reply."""


class WorldPart(BasePart):
    """The shared world, ready for a bus.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        hosted: (name, car file) of cars to spawn at the start; they circulate.
        room: Spare capacity: how many more cars may come.
        restored: State stored by an earlier run: its cars replace `hosted`, and those of `hosted`
            that it contains circulate again.
        city: Its name on the bus, by which the cities next to it know it.
    """

    name = NAME
    role = "part"
    period_ns = PERIOD_NS
    services: Sequence[Service] = (*SERVICES, Service(HandoverRequest))

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        hosted: tuple[tuple[str, str], ...] = (),
        room: int = ROOM,
        restored: RestoredState | None = None,
        city: str = "city",
    ) -> None:
        self._restored = restored or RestoredState()
        restored_files = {car.car_file for car in self._restored.cars.values()}
        cars = {DEFAULT_CAR, *(car for _, car in hosted), *restored_files}
        capacity = max(len(hosted), len(self._restored.cars)) + room
        capacity += MAX_GHOSTS if city_map.neighbours else 0
        self.world = World(city_map, seed, capacity=capacity, prepare=sorted(cars), city=city)
        self.subscriptions: Sequence[Subscription] = subscriptions_of(())
        self._to_spawn = hosted
        self._definition: WorldDefinition | None = None
        self._definition_due_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns`; the first step also publishes the definition and spawns the cars."""
        first = self.begin(now_ns)
        joined = set(self.world.cars.remote)
        sent = tick(self.world, now_ns, inbox)
        if joined != set(self.world.cars.remote):
            self.subscriptions = subscriptions_of(self.world.cars.remote)
        return [*first, *sent]

    def begin(self, now_ns: int) -> list[Outgoing]:
        """Return what is sent before a tick: the definition when it is due, and the first cars."""
        first: list[Outgoing] = []
        if self._definition is None:
            self._definition = WorldDefinition(
                t_ns=now_ns, seed=self.world.seed, map=_mapped(self.world.city_map)
            )
            first = [self._definition, *self._open(now_ns)]
            self._definition_due_ns = now_ns + DEFINITION_EVERY_NS
        elif now_ns >= self._definition_due_ns:
            first = [self._definition]
            self._definition_due_ns = now_ns + DEFINITION_EVERY_NS
        return first

    def attach(self, is_wanted: IsWanted) -> None:
        """Check for subscribers before making costly messages."""
        self.world.subscribers.attach(is_wanted)

    def _open(self, now_ns: int) -> list[Outgoing]:
        world, out = self.world, list[Outgoing]()
        stop = self._restored.stop
        if stop is not None and stop.engaged:
            reason = "still engaged when the world was started again"
            request = StopRequest(engaged=True, by=stop.by, reason=reason)
            reply_to(world, request, now_ns, out)
        out += restore(world, self._restored, now_ns)
        if self._restored.is_first:
            self._spawn_all(now_ns, out)
        at_start = {name for name, _ in self._to_spawn}
        for car in world.cars.hosted.values():
            is_here = not car.lease.is_leased and car.row != ELSEWHERE
            if (car.name in at_start or car.circulates) and is_here:
                out += self._circulate(car, now_ns)
        return out

    def _spawn_all(self, now_ns: int, out: list[Outgoing]) -> None:
        places = iter(self.world.city_map.spawns)
        for name, car_file in self._to_spawn:
            answer = self._spawn(name, car_file, places, now_ns, out)
            if isinstance(answer, Refused):
                msg = f"{name}: {answer.detail}"
                raise RunError(msg)

    def _circulate(self, car: HostedCar, now_ns: int) -> list[Outgoing]:
        try:
            send(self.world, car, RouteRequest(vehicle=car.name), now_ns)
        except ScmError as cause:
            text = f"{cause}; it stands"
            return [city_event("info", "no_circulation", text, now_ns, car.name)]
        return []

    def _spawn(
        self, name: str, car_file: str, places: Iterator[Spawn], now_ns: int, out: list[Outgoing]
    ) -> Message:
        """Put a car of the start onto the next place; trying the first ones again would be slow."""
        for place in places:
            request = SpawnRequest(vehicle=name, car=car_file, spawn=place.name)
            answer = reply_to(self.world, request, now_ns, out)
            if not isinstance(answer, Refused) or answer.code != "occupied":
                return answer
        return reply_to(self.world, SpawnRequest(vehicle=name, car=car_file), now_ns, out)


def _mapped(city_map: CityMap) -> CityMap:
    """Return the map as agents get it: without boxes that nobody has mapped."""
    boxes = tuple(box for box in city_map.boxes if box.mapped)
    return city_map if len(boxes) == len(city_map.boxes) else replace(city_map, boxes=boxes)
