"""Cars driven to and fro between two cities while the link fails and worlds are killed.

    python -m bench handover [--moments N] [--seed N]

Two cities in lockstep, each with its world, signals, monitor and store, joined by a faulty link. At
random moments about a crossing a world is killed and started again from its store, or the link is
cut, or loses, doubles and delays messages. At every tick each car must be in exactly one of: a
city's cars, or its transfers that the other has not taken (limit: 0 lost, 0 doubled); and each
signal must report in every period (limit: none late).
"""

import argparse
import random
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.records.city_map import BorderRoad, CityMap, Lane, Neighbour, Segment, Spawn
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.store.memory import MemoryStore
from scm.store.records import CarRecord, records
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.messages.spat import Spat
from scm.world.border_state import ArrivalRecord, OutgoingRecord
from scm.world.part import WorldPart
from scm.world.restore import read_restored

MAPS = Path(__file__).parents[1] / "examples" / "cities"
CITIES = ("west", "east")
TICK_S = 0.02
CALM = FaultRates()
SPAT_LATE_S = 0.2
"""A signal that reports 10 times a second is late after two periods."""


def half_loop(city: str) -> CityMap:
    """Return one half of the loop in `examples/cities`."""
    return load_map(MAPS / f"half_loop_{city}.toml")


def endless_road(city: str, other: str, length_m: float = 1.6) -> CityMap:
    """Return a city that is one straight road from its border to its border.

    Each of two such cities begins where the other one ends: a car crosses the border every few
    seconds. No plane holds them both, so cars do not see one another over the border.
    """
    lane = Lane(
        name="road",
        width_m=0.3,
        start=(0.0, 0.0, 0.0),
        segments=(Segment(length_m=length_m),),
        speed_limit_mps=0.6,
    )
    road = BorderRoad(out="road", to="road")
    neighbour = Neighbour(city=other, origin=(length_m, 0.0, 0.0), roads=(road,))
    spawns = tuple(
        Spawn(name=f"s{k}", lane="road", at_m=0.3 + 0.5 * k) for k in range(int(length_m / 0.5))
    )
    empty = half_loop(city)
    return replace(
        empty, lanes=(lane,), junctions=(), stop_lines=(), spawns=spawns, neighbours=(neighbour,)
    )


class TwoCities:
    """Two cities on one clock and one network, with a link whose faults are chosen.

    Args:
        maps: Of both, by name.
        hosted: Names of each one's cars.
        seed: Of the link's faults and the cars.
        with_signals: Whether each has traffic signals and a monitor.
        order: In which the worlds step.
    """

    def __init__(
        self,
        maps: dict[str, CityMap],
        hosted: Mapping[str, tuple[str, ...]],
        seed: int = 0,
        *,
        with_signals: bool = False,
        order: Iterable[str] = CITIES,
    ) -> None:
        self.faults = Faults(seed)
        self.faults.link_rates = CALM
        self.maps, self.hosted, self.seed = maps, hosted, seed
        self.stores = {city: MemoryStore() for city in maps}
        self.names = [name for names in hosted.values() for name in names]
        self.run = Lockstep([], faults=self.faults)
        self.worlds: dict[str, WorldPart] = {}
        self.lost: Counter[str] = Counter()
        self.doubled: Counter[str] = Counter()
        for city in order:
            self.start(city)
            for part in (TrafficPart(maps[city]), MonitorPart(maps[city])) if with_signals else ():
                self.run.add(part, city=city)

    def start(self, city: str) -> None:
        """Start a world from its store."""
        self.worlds[city] = WorldPart(
            self.maps[city],
            self.seed,
            tuple((name, "nigel") for name in self.hosted[city]),
            room=2 * len(self.names) + 4,
            restored=read_restored(self.stores[city]),
            city=city,
        )
        self.run.add(self.worlds[city], self.stores[city], city)

    def kill(self, city: str) -> None:
        """Kill a world as a SIGKILL would, and start it again."""
        self.run.kill(self.worlds[city])
        self.start(city)

    def cut(self) -> None:
        """Cut the link."""
        self.faults.partition([f"{CITIES[0]}/world"])

    def restore_link(self) -> None:
        """Bring the link back, without faults."""
        self.faults.partition([])
        self.faults.link_rates = CALM

    def tick(self) -> None:
        """Advance one tick, and count cars that are nowhere or in two places."""
        self.run.run_for(TICK_S)
        for count in (self.stored(), self.simulated()):
            for name in self.names:
                self.lost[name] += count[name] == 0
                self.doubled[name] += count[name] > 1

    def stored(self) -> Counter[str]:
        """Return in how many places each car is by what the stores hold."""
        found: Counter[str] = Counter()
        for city, store in self.stores.items():
            found.update(records(store, "leases", "world", CarRecord).keys())
            outgoing = records(store, "handovers", "world/out", OutgoingRecord)
            for name, record in outgoing.items():
                there = records(self.stores[record.city], "handovers", "world/in", ArrivalRecord)
                arrival = there.get(f"{city}/{name}")
                epoch = record.request.epoch
                is_done = arrival is not None and arrival.epoch == epoch and not arrival.refused
                found[name] += not is_done
        return found

    def simulated(self) -> Counter[str]:
        """Return likewise by what the worlds hold."""
        found: Counter[str] = Counter()
        for city, part in self.worlds.items():
            found.update(list(part.world.cars.hosted))
            for name, away in part.world.border.leaving.items():
                arrivals = self.worlds[away.road.city].world.border.arrivals
                arrival = arrivals.get((city, name))
                epoch = away.request.epoch
                is_done = arrival is not None and arrival.epoch == epoch and not arrival.refused
                found[name] += not is_done
        return found

    def bring(self, name: str) -> None:
        """Put a car shortly before the border, and the other one out of its way."""
        for other in sorted(self.names, key=lambda one: one == name):
            city = self.where(other)
            if city is None:
                continue
            world = self.worlds[city].world
            car, (road,) = world.cars.hosted[other], world.border.exits.values()
            s = road.length_m - 0.1 if other == name else 0.6 * road.length_m
            if self.where(name) == city and other != name:
                s = 0.1
            car.fleet.place(car.row, road.end @ Pose2(s - road.length_m, 0.0, 0.0), 0.25)
            driver = world.drivers.handed(car.index, self.run.now_ns)
            world.trips.enter(car.index, other, road.lane, s, driver, self.run.now_ns)

    def where(self, name: str) -> str | None:
        """Return the city that simulates a car; None: it is on its way."""
        cities = (city for city in CITIES if name in self.worlds[city].world.cars.hosted)
        return next(cities, None)


def is_about_to_cross(cities: TwoCities, within_m: float) -> bool:
    """Return whether a car that may cross has its rear axle this near the border."""
    return any(
        claim.until_ns > cities.run.now_ns
        and name in part.world.cars.hosted
        and claim.road.end.inverse() @ part.world.cars.hosted[name].pose > (-within_m,)
        for part in cities.worlds.values()
        for name, claim in part.world.border.approaching.items()
    )


def moment(cities: TwoCities, rng: random.Random, *, bring: bool = False) -> Counter[str]:
    """Let things go wrong about the tick in which a car crosses; return what did."""
    cities.restore_link()
    if bring:
        cities.tick()
        cities.bring(rng.choice(cities.names))
    for _ in range(40 if bring else 150):
        if is_about_to_cross(cities, 0.03):
            break
        cities.tick()
    what: Counter[str] = Counter()
    for _ in range(rng.randrange(1, 4)):
        for _ in range(rng.randrange(8)):
            cities.tick()
        what[misfortune(cities, rng)] += 1
    for _ in range(rng.randrange(25)):
        cities.tick()
    return what


def misfortune(cities: TwoCities, rng: random.Random) -> str:
    """Let one thing go wrong now, or everything be well again; return what."""
    what = rng.choice(("kill", "kill", "cut", "weather", "restore"))
    if what == "kill":
        cities.kill(rng.choice(CITIES))
    elif what == "cut":
        cities.cut()
    elif what == "weather":
        cities.faults.link_rates = FaultRates(
            drop=rng.choice((0.0, 0.3, 0.7)),
            duplicate=rng.choice((0.0, 0.5)),
            late=rng.choice((0.0, 0.5)),
            late_s=rng.choice((0.05, 0.5, 5.0)),
        )
    else:
        cities.restore_link()
    return what


def main() -> None:
    """Run the benchmark; see the module's docstring."""
    parser = argparse.ArgumentParser(prog="python -m bench handover")
    parser.add_argument("--moments", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, began = random.Random(arguments.seed), time.perf_counter()
    maps = {city: half_loop(city) for city in CITIES}
    hosted = {city: (f"{city[0]}1",) for city in CITIES}
    cities = TwoCities(maps, hosted, arguments.seed, with_signals=True)
    signals = {city: Signals(cities, city) for city in CITIES}
    what: Counter[str] = Counter()
    crossings, before = 0, {name: cities.where(name) for name in cities.names}
    for number in range(arguments.moments):
        what += moment(cities, rng, bring=True)
        for name, city in before.items():
            now = cities.where(name)
            crossings += now not in (None, city)
            before[name] = now or city
        for watched in signals.values():
            watched.look()
        if number % 100 == 99:
            spent_s = time.perf_counter() - began
            print(f"{number + 1} moments, {crossings} crossings, {spent_s:.0f} s", flush=True)
    cities.restore_link()
    for _ in range(250):
        cities.tick()
    missing = [name for name in cities.names if cities.where(name) is None]
    print(f"\nseed {arguments.seed}: {dict(what)}, {crossings} crossings")
    print(f"lost      {sum(cities.lost.values()) + len(missing):6d}   limit 0")
    print(f"doubled   {sum(cities.doubled.values()):6d}   limit 0")
    for city, watched in signals.items():
        print(f"{city} signals late {watched.late:4d} of {watched.count}   limit 0")


class Signals:
    """The signal reports of a city, and how many of them came late."""

    def __init__(self, cities: TwoCities, city: str) -> None:
        self._box = cities.run.subscribe(Subscription(Spat), city=city)
        self._last_ns: int | None = None
        self.late = self.count = 0

    def look(self) -> None:
        """Count what came since the last look."""
        for item in self._box.drain():
            if self._last_ns is not None:
                self.late += item.t_ns - self._last_ns > SPAT_LATE_S * NS_PER_S
            self._last_ns = item.t_ns
            self.count += 1


if __name__ == "__main__":
    main()
