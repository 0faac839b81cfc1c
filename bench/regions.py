"""A city in regions beside one world: equal cars, the cost of cutting, and more nodes by a model.

    python -m bench regions [--cars 4000] [--seconds 60]

Cars circulate on
a grid of streets with signals; each region is a process with its own copy of the traffic part. The
digests of all cars' whole states are compared at each second. Times are those of the world's steps
alone, means over the ticks after the first second; those of regions include their waiting. The
model of more nodes takes processor times, which other programs on the machine change less.
"""

import argparse
import multiprocessing
import os
import time
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from bench.city import grid_for
from scm.clock import NS_PER_S
from scm.records.city_map import CityMap
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, IsWanted
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.route_request import RouteRequest
from scm.world.driving import send
from scm.world.hosted import ELSEWHERE
from scm.world.part import WorldPart
from scm.world.regions.cut import cut_map
from scm.world.regions.part import RegionPart
from scm.world.regions.pipes import Pipes, pipes
from scm.world.regions.transfer import digest
from scm.world.world import PERIOD_NS

CARS, SPAN_S = 4000, 60.0
REGIONS = (1, 2, 4)
NODES = (1, 2, 4, 8, 16, 32, 64)
CITIES = (4000, 40_000, 100_000)
LINKS = (("0.5 ms, 10 Gbit/s", 5e-4, 1.25e9), ("5 ms, 10 Gbit/s", 5e-3, 1.25e9))
TICK_S = PERIOD_NS / NS_PER_S

Digests = dict[str, bytes]


class Cost(NamedTuple):
    """What the ticks of one process took, on average [s].

    Attributes:
        used_s: Of processor time, of all threads.
        waits_s: Of the tick, until the messages of the others were there.
    """

    tick_s: float
    used_s: float
    waits_s: float
    sent_bytes: float
    owned: float
    moved: int
    missed: int


class Timed(BasePart):
    """A world whose steps are timed, and whose cars are looked at once a second."""

    def __init__(self, part: WorldPart) -> None:
        self.part = part
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self.spent: list[float] = []
        self.used: list[float] = []
        self.owned: list[int] = []
        self.digests: list[Digests] = []

    @property
    def subscriptions(self) -> Any:
        return self.part.subscriptions

    def attach(self, is_wanted: IsWanted) -> None:
        self.part.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        began, used = time.perf_counter(), time.process_time()
        out = self.part.step(now_ns, inbox)
        self.spent.append(time.perf_counter() - began)
        self.used.append(time.process_time() - used)
        if now_ns % NS_PER_S == 0:
            world = self.part.world
            cars = [car for car in world.cars.hosted.values() if car.row != ELSEWHERE]
            self.digests.append({car.name: digest(world, car, now_ns) for car in cars})
            self.owned.append(len(cars))
        return out


class TimedPipes:
    """The pipes of a region: how long it waited for the others, and how much it sent."""

    def __init__(self, own: Pipes) -> None:
        self._own = own
        self.waits: list[float] = []
        self.sent: list[int] = []

    def __call__(self, messages: Sequence[bytes]) -> list[bytes]:
        began = time.perf_counter()
        received = self._own(messages)
        self.waits.append(time.perf_counter() - began)
        self.sent.append(max(map(len, messages)))
        return received


def drive(part: WorldPart, city_map: CityMap, cars: int, span_s: float) -> Timed:
    """Fill a world, or a region of it, and run it in lockstep with its traffic."""
    world, spawns, timed = part.world, city_map.spawns, Timed(part)
    for i in range(cars):
        pose = world.roads.spawn_pose(spawns[i * len(spawns) // cars].name)
        car = world.host(f"n{i + 1}", "nigel", pose, 0)
        if car.row != ELSEWHERE:
            send(world, car, RouteRequest(vehicle=car.name), 0)
    with Lockstep([timed, TrafficPart(city_map), MonitorPart(city_map)]) as city:
        city.run_for(span_s)
    return timed


def late(values: Sequence[float]) -> float:
    """Return the mean after the first second, in which all that is lazy is made; 0: no values."""
    return float(np.mean(values[round(1.0 / TICK_S) :])) if values else 0.0


def region_process(
    number: int, cars: int, span_s: float, own: Pipes, regions: int, result: "Connection[Any, Any]"
) -> None:
    """Be one region; send its cost and its cars' digests."""
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[number % len(cores)]})
    city_map, exchange = grid_for(cars), TimedPipes(own)
    part = RegionPart(city_map, cut_map(city_map, regions), number, exchange, room=cars)
    timed, owns = drive(part, city_map, cars, span_s), part.region.ownership
    cost = Cost(
        late(timed.spent), late(timed.used), late(exchange.waits), late(exchange.sent),
        float(np.mean(timed.owned)), owns.moved, owns.missed,
    )  # fmt: skip
    result.send((cost, timed.digests))


def in_regions(regions: int, cars: int, span_s: float) -> tuple[list[Cost], list[Digests]]:
    """Run a city in so many processes; return what each took, and all cars' digests by second."""
    spawned, results = multiprocessing.get_context("spawn"), []
    for number, own in enumerate(pipes(regions)):
        here, there = spawned.Pipe(duplex=False)
        given = (number, cars, span_s, own, regions, there)
        spawned.Process(target=region_process, args=given, daemon=True).start()
        there.close()
        own.close()
        results.append(here)
    costs, parts = zip(*(one.recv() for one in results), strict=True)
    return list(costs), [
        {name: value for part in second for name, value in part.items()}
        for second in zip(*parts, strict=True)
    ]


def model(own_s: float, all_s: float, handling_s: float, bytes_a_car: float) -> None:
    """Print what a tick takes on more nodes, and how many a city needs in real time."""
    print("\nModel: ms a tick of 20 ms, links and cities across, nodes down")
    heads = [f"{cars} cars, {name}" for name, _, _ in LINKS for cars in CITIES]
    print("nodes  " + "  ".join(f"{head:>28}" for head in heads))
    for nodes in NODES:
        row = []
        for _, latency_s, rate in LINKS:
            for cars in CITIES:
                elsewhere = cars * (nodes - 1) / nodes
                tick_s = own_s * cars / nodes + all_s * elsewhere
                if nodes > 1:
                    tick_s += latency_s + bytes_a_car * elsewhere / rate + handling_s * (nodes - 1)
                row.append(f"{tick_s * 1e3:>21.2f} {'' if tick_s > TICK_S else 'real-t.':>6}")
        print(f"{nodes:>5}  " + "  ".join(row))


def report(name: str, costs: Sequence[Cost]) -> None:
    for number, cost in enumerate(costs):
        times = (
            f"{cost.tick_s * 1e3:6.2f} ms a tick, of it waiting {cost.waits_s * 1e3:5.2f}, "
            f"{cost.used_s * 1e3:.2f} ms of processors"
        )
        cars = (
            f"{cost.owned:.0f} cars, {cost.moved} came or went, {cost.missed} missed, "
            f"{cost.sent_bytes / 1e3:.1f} kB to each other region"
        )
        print(f"{name:<10} region {number}: {times}; {cars}", flush=True)


def main() -> None:
    """Run the city in one world and in regions, and print what each takes."""
    parser = argparse.ArgumentParser(prog="python -m bench regions", description=__doc__)
    parser.add_argument("--cars", type=int, default=CARS)
    parser.add_argument("--seconds", type=float, default=SPAN_S)
    given = parser.parse_args()
    cars, span_s = given.cars, given.seconds
    city_map = grid_for(cars)
    threads = min(2, os.cpu_count() or 1)
    part = WorldPart(city_map, room=cars)
    part.world.use_threads(threads)
    whole = drive(part, city_map, cars, span_s)
    whole_s, used_s = late(whole.spent), late(whole.used)
    print(f"{cars} cars, {len(city_map.junctions)} signals, {span_s:.0f} s")
    used = f"{used_s * 1e3:.2f} ms of processors"
    print(f"one world, {threads} threads: {whole_s * 1e3:.2f} ms a tick, {used}", flush=True)
    measured = {}
    for regions in REGIONS:
        costs, digests = in_regions(regions, cars, span_s)
        measured[regions] = costs
        report(f"{regions} regions", costs)
        wrong = sum(got != wanted for got, wanted in zip(digests, whole.digests, strict=True))
        tick_s = max(cost.tick_s for cost in costs)
        print(
            f"    {len(digests)} looks at {len(digests[0])} cars, {wrong} differ; "
            f"{tick_s / whole_s:.2f} of one world with {threads} threads, "
            f"{sum(cost.used_s for cost in costs) / used_s:.2f} of its processor time",
            flush=True,
        )
    busy = {n: max(c.used_s for c in costs) for n, costs in measured.items()}
    own_s = busy[1] / cars
    half = max(c.owned for c in measured[2])
    all_s = max(0.0, busy[2] - own_s * half) / (cars - half)
    handling_s = max(0.0, busy[4] - own_s * max(c.owned for c in measured[4]) - 0.75 * cars * all_s)
    a_car = max(c.sent_bytes / c.owned for c in measured[2])
    print(
        f"\nof a car: {own_s * 1e6:.2f} us where it is, {all_s * 1e6:.2f} us elsewhere, "
        f"{a_car:.0f} bytes; of a message {handling_s / 3 * 1e6:.0f} us"
    )
    model(own_s, all_s, handling_s / 3, a_car)


if __name__ == "__main__":
    main()
