"""Whether a city flows: 200 cars on a grid, with lights and with signs, faster than real time.

Run with `python -m bench.flow [lights | signs | MAP ...] --seconds S`. Printed per city: junctions
passed an hour, the longest time that a car stood without a red light before it or its queue, cars
that touched, simulated over elapsed time. `--loss 0.2` lets each driver miss so many radio frames.
"""

import argparse
import math
import time

import numpy as np

from bench.city import fill
from scm.arrays import Bools, Floats, Ints
from scm.lockstep import Lockstep
from scm.maps.load import load_map
from scm.traffic.monitor_part import MonitorPart
from scm.traffic.part import TrafficPart
from scm.vehicles.drivers.crowd import Crowd
from scm.vehicles.drivers.memory import SIGNAL
from scm.world.contacts import Contacts, Touches
from scm.world.part import WorldPart
from scm.world.world import World

MAPS = {"lights": "grid:8x8:4", "signs": "grid:8x8:4:signs"}
LOOK_S = 0.5
STANDS_MPS = 0.01


class TouchCount(Contacts):
    """The world's contacts, counted: how often two cars began to touch."""

    pairs: set[tuple[int, int]]
    began: list[tuple[int, int]]

    def step(self, slots: Ints, motion: Floats) -> Touches:
        """Solve a contact step, and note which cars touch that did not before."""
        touches = super().step(slots, motion)
        now = {(int(slots[a]), int(slots[b])) for a, b in touches.pairs.tolist() if min(a, b) >= 0}
        self.began += sorted(now - self.pairs)
        self.pairs = now
        return touches


def counted(world: World) -> TouchCount:
    """Put a counter over a world's contacts, and return it."""
    contacts = world.contacts
    contacts.__class__ = TouchCount
    assert isinstance(contacts, TouchCount)  # noqa: S101
    contacts.pairs, contacts.began = set(), []
    return contacts


class Standing:
    """How long each car has stood without a red light to explain it [s]."""

    def __init__(self, cars: int) -> None:
        self.now_s = np.zeros(cars)
        self.longest_s = np.zeros(cars)

    def look(self, crowd: Crowd, speed: Floats, passed_s: float) -> None:
        """Take note of the present instant, some time after the last one."""
        unexplained = (np.abs(speed) < STANDS_MPS) & ~behind_red(crowd)
        self.now_s = np.where(unexplained, self.now_s + passed_s, 0.0)
        np.maximum(self.longest_s, self.now_s, out=self.longest_s)


def behind_red(crowd: Crowd) -> Bools:
    """Return which cars wait at a red light, or on a lane where one ahead of them does."""
    waits = crowd.waiting == SIGNAL
    farthest = np.full(len(crowd.streets.names) + 1, -np.inf)
    np.maximum.at(farthest, crowd.lane[waits], crowd.s[waits])
    found: Bools = crowd.s <= farthest[crowd.lane]
    return found


def flow(
    name: str, cars: int, span_s: float, loss: float = 0.0, wall_s: float = math.inf
) -> dict[str, float]:
    """Run a city for a time, or until so much real time is over; return what there is to tell."""
    city_map = load_map(name)
    part = WorldPart(city_map, room=cars)
    if loss:
        part.world = World(city_map, capacity=cars, loss=loss, prepare=["nigel"])
    part.learn_wishes(lambda _kind, _where: False)
    world = part.world
    touched, crowd = counted(world), world.crowd
    fill(world, cars)
    standing = Standing(crowd.capacity)
    with Lockstep([part, TrafficPart(city_map), MonitorPart(city_map)]) as city:
        city.run_for(1.0)
        before, began = crowd.passed.copy(), time.perf_counter()
        for look in range(1, 1 + round(span_s / LOOK_S)):
            city.run_for(LOOK_S)
            standing.look(crowd, world.slots.speed, LOOK_S)
            took = time.perf_counter() - began
            if took > wall_s:
                span_s = look * LOOK_S
                break
    passed = float((crowd.passed - before).sum()) / 2.0
    return {
        "cars": cars,
        "hours": span_s / 3600.0,
        "passages_per_h": passed / span_s * 3600.0,
        "least": float((crowd.passed - before)[world.slots.hosted].min()) / 2.0,
        "longest_s": float(standing.longest_s.max()),
        "contacts": len(touched.began),
        "ratio": span_s / took,
    }


def main() -> None:
    """Print a table, a row a city."""
    parser = argparse.ArgumentParser(prog="python -m bench.flow", description=__doc__)
    parser.add_argument("cities", nargs="*", default=list(MAPS), help="lights, signs, or a map")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--wall", type=float, default=math.inf, help="s of real time at most")
    parser.add_argument("--cars", type=int, default=200)
    parser.add_argument("--loss", type=float, default=0.0)
    given = parser.parse_args()
    print("| city | cars | hours | junctions passed an hour | fewest by a car | longest stand, s "
          "| contacts | x real time |")  # fmt: skip
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    for city in given.cities:
        row = flow(MAPS.get(city, city), given.cars, given.seconds, given.loss, given.wall)
        print(
            f"| {city} | {row['cars']:.0f} | {row['hours']:.3f} | {row['passages_per_h']:.0f} "
            f"| {row['least']:.0f} | {row['longest_s']:.1f} | {row['contacts']:.0f} "
            f"| {row['ratio']:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
