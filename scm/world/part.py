"""The world as a part of the city: its inbox goes into a tick, what the tick sends comes out."""

from collections.abc import Iterator, Sequence

from scm.clock import NS_PER_S
from scm.errors import RunError, ScmError
from scm.records.city_map import CityMap, Spawn
from scm.runtime.part import BasePart, IsWanted, Service, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_definition import WorldDefinition
from scm.world.driving import send
from scm.world.hearing import hears_of
from scm.world.hosted import HostedCar
from scm.world.requests import SERVES, reply_to
from scm.world.restore import Kept, bring_back
from scm.world.step import tick
from scm.world.world import DEFAULT_CAR, NAME, PERIOD_NS, World

ROOM = 256
SAY_AGAIN_NS = 10 * NS_PER_S
"""What the city is, is said again so often: the bus keeps it for late joiners, and rarely one of
them asked in vain."""


class WorldPart(BasePart):
    """The shared world, ready for a bus.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        hosted: (name, car file) of cars to spawn at the start; they circulate.
        room: How many more cars may come.
        kept: What a run before this one left behind: its cars are there instead of `hosted`, of
            which those circulate again that are still there.
    """

    name = NAME
    role = "part"
    period_ns = PERIOD_NS
    services: Sequence[Service] = SERVES

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        hosted: tuple[tuple[str, str], ...] = (),
        room: int = ROOM,
        kept: Kept | None = None,
    ) -> None:
        self._kept = kept or Kept()
        kept_cars = {car.car_file for car in self._kept.cars.values()}
        cars = {DEFAULT_CAR, *(car for _, car in hosted), *kept_cars}
        capacity = max(len(hosted), len(self._kept.cars)) + room
        self.world = World(city_map, seed, capacity=capacity, prepare=sorted(cars))
        self.subscriptions: Sequence[Subscription] = hears_of(())
        self._to_spawn = hosted
        self._definition: WorldDefinition | None = None
        self._say_again_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns`; the first step also says what the city is and spawns its cars."""
        first: list[Outgoing] = []
        if self._definition is None:
            self._definition = WorldDefinition(
                t_ns=now_ns, seed=self.world.seed, map=self.world.city_map
            )
            first = [self._definition, *self._open(now_ns)]
            self._say_again_ns = now_ns + SAY_AGAIN_NS
        elif now_ns >= self._say_again_ns:
            first = [self._definition]
            self._say_again_ns = now_ns + SAY_AGAIN_NS
        joined = set(self.world.remote)
        said = tick(self.world, now_ns, inbox)
        if joined != set(self.world.remote):
            self.subscriptions = hears_of(self.world.remote)
        return [*first, *said]

    def attach(self, is_wanted: IsWanted) -> None:
        """Ask the bus from now on before making what is dear."""
        self.world.wishes.learn(is_wanted)

    def _open(self, now_ns: int) -> list[Outgoing]:
        world = self.world
        stop = self._kept.stop
        if stop is not None and stop.engaged:
            reason = "still engaged when the world was started again"
            reply_to(world, StopRequest(engaged=True, by=stop.by, reason=reason), now_ns)
        bring_back(world, self._kept, now_ns)
        if self._kept.is_first:
            self._spawn_all(now_ns)
        for name, _ in self._to_spawn:
            car = world.hosted.get(name)
            if car is not None and car.lease.is_at_home:
                self._circulate(car, now_ns)
        return list(world.outbox)

    def _spawn_all(self, now_ns: int) -> None:
        places = iter(self.world.city_map.spawns)
        for name, car_file in self._to_spawn:
            answer = self._spawn(name, car_file, places, now_ns)
            if isinstance(answer, Refused):
                msg = f"{name}: {answer.detail}"
                raise RunError(msg)

    def _circulate(self, car: HostedCar, now_ns: int) -> None:
        try:
            send(self.world, car, RouteRequest(vehicle=car.name), now_ns)
        except ScmError as cause:
            self.world.say("info", "no_circulation", f"{cause}; it stands", now_ns, car.name)

    def _spawn(self, name: str, car_file: str, places: Iterator[Spawn], now_ns: int) -> Message:
        """Put a car of the start onto the next place; trying the first ones again would be slow."""
        for place in places:
            request = SpawnRequest(vehicle=name, car=car_file, spawn=place.name)
            answer = reply_to(self.world, request, now_ns)
            if not isinstance(answer, Refused) or answer.code != "occupied":
                return answer
        return reply_to(self.world, SpawnRequest(vehicle=name, car=car_file), now_ns)
