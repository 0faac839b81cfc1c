"""A region as a part of the city, and all regions in one process as the one part of a whole world.

`RegionsPart` is for lockstep: it gets what a world gets and sends what a world sends, bit by bit.
Its regions meet only by the encoded messages that `RegionPart` sends to another process.
"""

from collections.abc import Callable, Sequence

from msgspec.structs import replace

from scm.records.city_map import CityMap
from scm.runtime.part import BasePart, IsWanted, Service, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.alerts import NAME
from scm.world.part import ROOM, WorldPart
from scm.world.reception import subscriptions_of
from scm.world.regions.cut import Cut, cut_map
from scm.world.regions.region import Region
from scm.world.requests import SERVICES
from scm.world.world import PERIOD_NS, World

Exchange = Callable[[Sequence[bytes]], Sequence[bytes]]
"""Sends a message to each region, by number, and returns one of each other region."""


class RegionPart(WorldPart):
    """One region, ready for a bus; the others are in processes of their own.

    Args:
        city_map: The city.
        cut: Of the map, the same in all regions.
        number: Of this region.
        exchange: Connects it to the others.
        seed: Of all noise and of lost radio frames; the same in all regions.
        hosted: (name, car file) of all cars of the city to spawn at the start; they circulate.
        room: Spare capacity: how many more cars may come.
    """

    def __init__(
        self,
        city_map: CityMap,
        cut: Cut,
        number: int,
        exchange: Exchange,
        seed: int = 0,
        hosted: tuple[tuple[str, str], ...] = (),
        room: int = ROOM,
    ) -> None:
        super().__init__(city_map, seed, hosted, room)
        self.region = Region(self.world, cut, number)
        self._exchange = exchange

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance to `now_ns` together with the other regions, each in its process."""
        first = [one for one in self.begin(now_ns) if self.region.speaks_of(one)]
        moved, messages = self.region.advance(now_ns, inbox)
        received = self._exchange(messages)
        return [*first, *moved, *self.region.report(now_ns, received)]


class RegionsPart(BasePart):
    """A city of regions, ready for a bus.

    Args:
        city_map: The city.
        regions: How many.
        seed: Of all noise and of lost radio frames.
        hosted: (name, car file) of cars to spawn at the start; they circulate.
        room: Spare capacity: how many more cars may come.
        by: How the map is cut, as in `cut_map`.

    Raises:
        MapError: The map cannot be cut into so many regions.
    """

    name = NAME
    role = "part"
    period_ns = PERIOD_NS
    services: Sequence[Service] = SERVICES

    def __init__(
        self,
        city_map: CityMap,
        regions: int,
        seed: int = 0,
        hosted: tuple[tuple[str, str], ...] = (),
        room: int = ROOM,
        by: str | None = None,
    ) -> None:
        cut = cut_map(city_map, regions, by=by)
        self._parts = [WorldPart(city_map, seed, hosted, room) for _ in range(regions)]
        self.regions = [Region(part.world, cut, n) for n, part in enumerate(self._parts)]
        self.subscriptions: Sequence[Subscription] = subscriptions_of(())

    def attach(self, is_wanted: IsWanted) -> None:
        """Check for subscribers before making costly messages."""
        for part in self._parts:
            part.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Advance all regions to `now_ns`; return what the city sends."""
        out: list[Outgoing] = []
        sent: list[list[bytes]] = []
        for part, region in zip(self._parts, self.regions, strict=True):
            out += [one for one in part.begin(now_ns) if region.speaks_of(one)]
            moved, messages = region.advance(now_ns, inbox)
            out += moved
            sent.append(messages)
        for number, region in enumerate(self.regions):
            received = [messages[number] for n, messages in enumerate(sent) if n != number]
            out += region.report(now_ns, received)
        return with_one_snapshot(self.regions[0].world, out)


def with_one_snapshot(world: World, out: Sequence[Outgoing]) -> list[Outgoing]:
    """Join the snapshots of all regions into one of the city, cars by vehicle index."""
    parts = [one for one in out if isinstance(one, WorldSnapshot)]
    if not parts:
        return list(out)
    cars = [car for part in parts for car in part.vehicles]
    cars.sort(key=lambda car: world.cars.hosted[car.vehicle].index)
    others = [one for one in out if not isinstance(one, WorldSnapshot)]
    return [*others, replace(parts[0], vehicles=tuple(cars))]
