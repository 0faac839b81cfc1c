"""A city cut into regions, tick by tick beside the same city in one world."""

from collections import Counter

import msgspec
import pytest

from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Answer
from scm.world.part import WorldPart
from scm.world.regions.part import RegionsPart
from scm.world.regions.transfer import digest

CITY, CARS, SECONDS, SEED = "grid:5x4:3", 120, 6.0, 3
EVERY = 10  # ticks between two looks at the memory


class Recorder(BasePart):
    """A world whose messages are all wanted; it notes what is sent, and what the cars are."""

    def __init__(self, part, worlds):
        self._part, self._worlds = part, worlds
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self.sent, self.cars = [], []
        self.script = {}

    @property
    def subscriptions(self):
        return self._part.subscriptions

    def step(self, now_ns, inbox):
        out = self._part.step(now_ns, inbox)
        self.sent.append(Counter(words(one) for one in out))
        if len(self.sent) % EVERY == 0:
            self.cars.append(cars_of(self._worlds, now_ns))
        return out


def words(outgoing):
    """Return all that an outgoing item says, with every bit of its floats."""
    said = outgoing.reply if isinstance(outgoing, Answer) else outgoing
    return type(said).__name__, msgspec.msgpack.encode(said)


def cars_of(worlds, now_ns):
    """Return a digest of each car's whole state, by name, from the world that simulates it."""
    found = {}
    for world in worlds:
        here = {
            name: digest(world, car, now_ns)
            for name, car in world.cars.hosted.items()
            if not world.cars.arrays.elsewhere[car.index]
        }
        assert not here.keys() & found.keys()
        found |= here
    return found


def run(part, worlds, script=lambda city: None):
    recorder = Recorder(part, worlds)
    parts = [recorder, TrafficPart(part_map(part)), MonitorPart(part_map(part))]
    with Lockstep(parts) as city:
        script(city)
        city.run_for(SECONDS)
    return recorder


def part_map(part):
    return (part.regions[0] if isinstance(part, RegionsPart) else part).world.city_map


def hosted(count):
    return tuple((f"n{i + 1}", "nigel") for i in range(count))


@pytest.fixture(scope="module")
def whole():
    part = WorldPart(load_map(CITY), SEED, hosted(CARS), room=8)
    return run(part, [part.world])


@pytest.mark.parametrize(("regions", "by"), [(1, None), (2, None), (3, "bisection"), (4, None)])
def test_city_in_regions_equals_one_world_bit_by_bit(whole, regions, by):
    part = RegionsPart(load_map(CITY), regions, SEED, hosted(CARS), room=8, by=by)
    cut = run(part, [region.world for region in part.regions])
    for tick, (expected, got) in enumerate(zip(whole.sent, cut.sent, strict=True)):
        assert got == expected, f"tick {tick}: {list((got - expected) + (expected - got))[:4]}"
    assert cut.cars == whole.cars
    moved = sum(region.ownership.moved for region in part.regions) // 2
    assert moved >= (20 if regions > 1 else 0)
    assert sum(region.ownership.missed for region in part.regions) == 0
