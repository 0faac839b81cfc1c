"""The world as a part of the city: its inbox goes into a tick, what the tick sends comes out."""

from collections.abc import Sequence

from scm.errors import RunError, ScmError
from scm.maps.model import CityMap
from scm.part import Hears, Serves
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Refused
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_definition import WorldDefinition
from scm.world.hearing import HEARS
from scm.world.requests import SERVES, reply_to, send
from scm.world.step import tick
from scm.world.world import DEFAULT_CAR, NAME, PERIOD_NS, World


class WorldPart:
    """The shared world, ready for a bus.

    Args:
        city_map: The city.
        seed: Of all noise and of lost radio frames.
        hosted: (name, car file) of cars to spawn at the start; they circulate.
        stopped_by: Who engaged the city stop in a run before this one; None: nobody.
    """

    name = NAME
    role = "part"
    period_ns = PERIOD_NS
    hears: Sequence[Hears] = HEARS
    serves: Sequence[Serves] = SERVES

    def __init__(
        self,
        city_map: CityMap,
        seed: int = 0,
        hosted: tuple[tuple[str, str], ...] = (),
        stopped_by: str | None = None,
    ) -> None:
        cars = {DEFAULT_CAR, *(car for _, car in hosted)}
        self.world = World(city_map, seed, capacity=max(256, 2 * len(hosted)), prepare=sorted(cars))
        self._to_spawn = hosted
        self._stopped_by = stopped_by
        self._is_open = False

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns`; the first step also says what the city is and spawns its cars."""
        if self._is_open:
            return tick(self.world, now_ns, inbox)
        self._is_open = True
        first = self._open(now_ns)
        return [*first, *tick(self.world, now_ns, inbox)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Leave without a word: presence tells."""
        return []

    def _open(self, now_ns: int) -> list[Outgoing]:
        world = self.world
        if self._stopped_by is not None:
            reason = "still engaged when the world was started again"
            stop = StopRequest(engaged=True, by=self._stopped_by, reason=reason)
            reply_to(world, stop, now_ns)
        for name, car_file in self._to_spawn:
            request = SpawnRequest(vehicle=name, car=car_file)
            answer = reply_to(world, request, now_ns)
            if isinstance(answer, Refused):
                msg = f"{name}: {answer.detail}"
                raise RunError(msg)
            try:
                send(world, world.hosted[name], RouteRequest(vehicle=name), now_ns)
            except ScmError as cause:
                world.say("info", "no_circulation", f"{cause}; it stands", now_ns, name)
        definition = WorldDefinition(t_ns=now_ns, seed=world.seed, map=world.city_map)
        return [definition, *world.outbox]
