"""A whole city beside real time: lockstep with 10 000 cars, with 2 000 LIDARs, and live with 1 000.

Run with `python -m bench city`, or `python -m bench.city [large | lidar | flat | live ...]`. Cars
circulate on a grid of streets with signals, one at each crossing. Ratios are simulated time over
elapsed time: 1 is real time, more is faster. Stages are processor time of a tick of 20 ms.
"""

import ctypes
import gc
import itertools
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

from scm.maps.load import load_map
from scm.records.city_map import CityMap
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.route_request import RouteRequest
from scm.world import step
from scm.world.driving import send
from scm.world.part import WorldPart
from scm.world.world import PERIOD_NS, World

STAGES = ("receive", "steer", "move", "watch", "sense", "publish", "send_radio")
WARM_S, SPAN_S = 2.0, 4.0
TICKS = SPAN_S * 1e9 / PERIOD_NS
BLOCK_M, FULL, LARGE = 12, 0.6, "grid:11x11:32"


class Stages:
    """Adds up what each stage of a tick takes, by standing in for its name in `step`."""

    def __init__(self) -> None:
        self.spent_s = dict.fromkeys(STAGES, 0.0)
        for name in STAGES:
            setattr(step, name, self._timed(name, getattr(step, name)))

    def _timed(self, name: str, stage: Callable[..., object]) -> Callable[..., object]:
        def call(*given: object) -> object:
            start = time.perf_counter()
            try:
                return stage(*given)
            finally:
                self.spent_s[name] += time.perf_counter() - start

        return call

    def clear(self) -> None:
        self.spent_s = dict.fromkeys(STAGES, 0.0)


def grid_for(cars: int, signals: int = 0) -> CityMap:
    """Return a grid city with at least so many signals, its places to stand 60 % full at most."""
    side = 3
    while True:
        city_map = load_map(f"grid:{side}x{side}:{BLOCK_M}")
        if FULL * len(city_map.spawns) >= cars and len(city_map.junctions) >= signals:
            return city_map
        side += 1


def fill(world: World, cars: int) -> None:
    """Put cars onto spawn places, evenly over the map, and let them circulate."""
    spawns = world.city_map.spawns
    for i in range(cars):
        pose = world.roads.spawn_pose(spawns[i * len(spawns) // cars].name)
        car = world.host(f"n{i + 1}", "nigel", pose, 0)
        send(world, car, RouteRequest(vehicle=car.name), 0)


def memory_mib() -> float:
    """Return what this process holds in memory now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def built(city_map: CityMap, cars: int) -> tuple[WorldPart, float]:
    """Return a world with so many cars, and the memory that it took [MiB], with all lanes made."""
    gc.collect()
    before_mib = memory_mib()
    part = WorldPart(city_map, room=cars)
    part.attach(lambda _kind, _where: False)
    roads = part.world.roads
    for lane in roads.lanes.values():
        roads.nearest(lane.at(0.0))
    fill(part.world, cars)
    part.step(0, [])
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # give back what the filling used for a while
    return part, memory_mib() - before_mib


def run(city_map: CityMap, cars: int, stages: Stages, *, lidar: bool = False) -> dict[str, float]:
    """Run a city in lockstep; return what it took."""
    built(city_map, 1)  # what all cities of one map share is there from now on
    few, few_mib = built(city_map, 1)
    part, many_mib = built(city_map, cars)
    held_kib = (many_mib - few_mib) * 1024.0 / (cars - 1)
    del few
    part.world.use_threads(os.cpu_count() or 1)
    parts = [part, TrafficPart(city_map), MonitorPart(city_map)]
    with Lockstep(parts) as city:
        scans = city.subscribe(Subscription(LidarScan)) if lidar else None
        city.run_for(WARM_S)
        stages.clear()
        if scans is not None:
            scans.drain()
        began, used = time.perf_counter(), time.process_time()
        city.run_for(SPAN_S)
        took, busy = time.perf_counter() - began, time.process_time() - used
    return {
        "cars": cars,
        "ratio": SPAN_S / took,
        "busy": busy / took,
        "us_a_car": took / TICKS / cars * 1e6,
        "world_us_a_car": sum(stages.spent_s.values()) / TICKS / cars * 1e6,
        "kib_a_car": held_kib,
        "junctions": len(city_map.junctions),
        "scans": len(scans.drain()) / SPAN_S if scans is not None else 0.0,
        "speed": float(part.world.cars.arrays.speed[part.world.cars.arrays.hosted].mean()),
    }


def report(name: str, stages: Stages, row: dict[str, float]) -> None:
    ticks = TICKS
    parts = "  ".join(f"{n} {s / ticks * 1e3:.2f}" for n, s in stages.spent_s.items())
    others = SPAN_S / row["ratio"] / ticks - sum(stages.spent_s.values()) / ticks
    scans = f"  {row['scans']:.0f} scans/s" if row["scans"] else ""
    print(
        f"{name:<24} {row['cars']:>6.0f} cars {row['junctions']:>4.0f} signals "
        f"{row['ratio']:>6.2f} x real time   {row['us_a_car']:.2f} us a car and tick, "
        f"of it the world {row['world_us_a_car']:.2f}   {row['kib_a_car']:.2f} KiB a car   "
        f"mean {row['speed']:.2f} m/s{scans}"
    )
    each = others / max(1.0, row["junctions"]) * 1e6
    print(
        f"    ms a tick: {parts}  other parts and bus {others * 1e3:.2f}, {each:.0f} us a junction",
        flush=True,
    )


def flat(stages: Stages) -> None:
    """Print how the cost of a car depends on their number."""
    cost = {}
    for cars in (100, 300, 1000, 3000, 10_000):
        row = run(grid_for(cars), cars, stages)
        cost[cars] = row["world_us_a_car"]
        report("scaling", stages, row)
    for cars, us in itertools.islice(cost.items(), 1, None):
        share = us / cost[100]
        print(f"    {cars:>6} cars: one costs the world {share:.2f} of what it costs among 100")


def main(wanted: tuple[str, ...] = ("large", "lidar", "flat")) -> None:
    stages = Stages()
    built(grid_for(1), 1)  # compiles, and holds what one world or many need once
    if "large" in wanted:
        report("lockstep, contacts", stages, run(load_map(LARGE), 10_000, stages))
    if "lidar" in wanted:
        row = run(grid_for(2000, 100), 2000, stages, lidar=True)
        report("lockstep, LIDAR on all", stages, row)
    if "flat" in wanted:
        flat(stages)
    if "live" in wanted:
        from bench.city_live import live

        live()


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or ("large", "lidar", "flat"))
