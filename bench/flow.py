"""Whether a city flows: 200 cars on a grid, with lights and with signs, faster than real time.

Run with `python -m bench.flow [lights | signs | MAP ...] --seconds S`. Printed per city: junctions
passed an hour, the same in each quarter of the time, the longest time that a car stood without a
red light before it or its queue, cars that touched, simulated over elapsed time.
`--loss 0.2` lets each driver miss so many radio frames. `--observe S` lets the observer judge the
first S seconds by the true poses with a camera's noise, so what it reports is false unless cars
touch. `--flash` lets all signals flash red. `--progress` prints a line each minute on stderr.
"""

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bench.city import fill
from scm.arrays import Bools, Floats, Ints
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.observation.part import ObserverPart
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.policy import FIXED
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.eye_track import EyeTrack, Row6
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.violation import Violation
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.driver_state import SIGNAL
from scm.world.contacts import Contacts, Touches
from scm.world.part import WorldPart
from scm.world.world import World

MAPS = {"lights": "grid:8x8:4", "signs": "grid:8x8:4:signs"}
LOOK_S = 0.5
STANDS_MPS = 0.01


POSE_STD_M, YAW_STD_RAD, SPEED_STD_MPS = 0.005, 0.01, 0.03
EYE_PERIOD_NS = 100_000_000


class Cameras(BasePart):
    """Stand for the overhead cameras: the world's true poses with the noise that they tell."""

    name, role, period_ns = "eye", "part", EYE_PERIOD_NS
    subscriptions: tuple[Subscription, ...] = ()

    def __init__(self, world: World) -> None:
        self._world = world
        self._dice = np.random.default_rng(1)
        variances = (POSE_STD_M, POSE_STD_M, YAW_STD_RAD, SPEED_STD_MPS, 0.01, 0.01)
        rows = np.diag(np.square(variances)).tolist()
        self._covariance: tuple[Row6, ...] = tuple(map(tuple, rows))  # type: ignore[arg-type]

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Tell a track of every hosted car."""
        del inbox
        vehicles = self._world.cars.arrays
        of = np.flatnonzero(vehicles.hosted)
        noise = self._dice.normal(size=(4, len(of)))
        rows = zip(
            of.tolist(),
            (vehicles.x[of] + POSE_STD_M * noise[0]).tolist(),
            (vehicles.y[of] + POSE_STD_M * noise[1]).tolist(),
            (vehicles.yaw[of] + YAW_STD_RAD * noise[2]).tolist(),
            (vehicles.speed[of] + SPEED_STD_MPS * noise[3]).tolist(),
            strict=True,
        )
        return [self._track(now_ns, *row) for row in rows]

    def _track(
        self, now_ns: int, vehicle: int, x: float, y: float, yaw: float, speed: float
    ) -> EyeTrack:
        return EyeTrack(
            vehicle=self._world.cars.arrays.names[vehicle], tag_id=1, t_ns=now_ns, x_m=x, y_m=y,
            yaw_rad=yaw, speed_mps=speed, lateral_speed_mps=0.0, yaw_rate_radps=0.0, age_s=0.0,
            stale=False, covariance=self._covariance,  # type: ignore[arg-type]
        )  # fmt: skip


class Observed:
    """Cameras and an observer that run in a city for its first time; what the observer found.

    Attributes:
        violations: How many violations of each kind, and the first few in words.
    """

    def __init__(self, city: Lockstep, world: World, span_s: float) -> None:
        self._city, self._left_s = city, span_s
        self._parts = [Cameras(world), ObserverPart(world.city_map)]
        self.violations: Counter[str] = Counter()
        self.words: list[str] = []
        self.counts: TrafficCounts | None = None
        for part in self._parts:
            city.add(part)
        self._mailbox = city.subscribe(Subscription(Violation))

    def look(self, passed_s: float) -> None:
        """Note what was found since; take the parts away when their time is over."""
        if not self._parts:
            return
        for item in self._mailbox.drain():
            violation = item.message
            self.violations[violation.kind] += 1
            self.words.append(violation.text)
        self._left_s -= passed_s
        observer = self._parts[-1]
        assert isinstance(observer, ObserverPart)  # noqa: S101
        self.counts = observer.counters.counts(self._city.now_ns)
        if self._left_s <= 0.0:
            while self._parts:
                self._city.remove(self._parts.pop())


class TouchCount(Contacts):
    """The world's contacts, counted: how often two cars began to touch."""

    pairs: set[tuple[int, int]]
    began: list[tuple[int, int]]

    def step(self, vehicles: Ints, motion: Floats) -> Touches:
        """Solve a contact step, and note which cars touch that did not before."""
        touches = super().step(vehicles, motion)
        now = {
            (int(vehicles[a]), int(vehicles[b]))
            for a, b in touches.pairs.tolist()
            if min(a, b) >= 0
        }
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

    def look(self, drivers: DriverBatch, speed: Floats, passed_s: float) -> None:
        """Take note of the present instant, some time after the last one."""
        unexplained = (np.abs(speed) < STANDS_MPS) & ~behind_red(drivers)
        self.now_s = np.where(unexplained, self.now_s + passed_s, 0.0)
        np.maximum(self.longest_s, self.now_s, out=self.longest_s)


def behind_red(drivers: DriverBatch) -> Bools:
    """Return which cars wait at a red light, or on a lane where one ahead of them does."""
    waits = drivers.waiting == SIGNAL
    farthest = np.full(len(drivers.lane_graph.names) + 1, -np.inf)
    np.maximum.at(farthest, drivers.lane[waits], drivers.s[waits])
    found: Bools = drivers.s <= farthest[drivers.lane]
    return found


class Count:
    """What is counted while a city runs; the driven time is cut into four quarters."""

    def __init__(self, world: World, span_s: float) -> None:
        self._world, self._span_s = world, span_s
        self._touched = counted(world)
        self.standing = Standing(world.drivers.capacity)
        self._passed = [world.drivers.passed.copy()]
        self._began = time.perf_counter()
        self.took_s = 0.0

    def look(self, at_s: float, *, prints_progress: bool) -> None:
        """Take note of an instant; `at_s` after the count began."""
        self.standing.look(self._world.drivers, self._world.cars.arrays.speed, LOOK_S)
        self.took_s = time.perf_counter() - self._began
        while at_s >= len(self._passed) * self._span_s / 4.0 and len(self._passed) <= 4:
            self._passed.append(self._world.drivers.passed.copy())
        if prints_progress and at_s % 60.0 < LOOK_S:
            print(
                f"{at_s:.0f} s of the city's time in {self.took_s:.0f} s; now longest stand "
                f"{self.standing.now_s.max():.0f} s, ever {self.standing.longest_s.max():.0f} s; "
                f"{len(self._touched.began)} contacts {self._touched.began[:3]}",
                file=sys.stderr,
                flush=True,
            )

    def row(self, span_s: float) -> dict[str, float]:
        """Return what there is to tell of a run that lasted so long."""
        drivers, hosted = self._world.drivers, self._world.cars.arrays.hosted
        passed = drivers.passed - self._passed[0]
        marks = [float(mark.sum()) / 2.0 for mark in self._passed]
        share = 4.0 * 3600.0 / self._span_s
        quarters = {f"quarter{i}": (b - a) * share for i, (a, b) in enumerate(pairwise(marks))}
        return {
            "cars": float(hosted.sum()),
            "hours": span_s / 3600.0,
            "passages_per_h": float(passed.sum()) / 2.0 / span_s * 3600.0,
            "least": float(passed[hosted].min()) / 2.0,
            "longest_s": float(self.standing.longest_s.max()),
            "contacts": len(self._touched.began),
            "ratio": span_s / self.took_s,
            **quarters,
        }


def flow(
    name: str,
    cars: int,
    span_s: float,
    loss: float = 0.0,
    wall_s: float = math.inf,
    *,
    policy: str = FIXED,
    observed_s: float = 0.0,
    prints_progress: bool = False,
) -> tuple[dict[str, float], Observed | None]:
    """Run a city for a time, or until so much real time is over; return what there is to tell."""
    city_map = load_map(name)
    part = WorldPart(city_map, room=cars)
    if loss:
        part.world = World(city_map, capacity=cars, loss=loss, prepare=["nigel"])
    part.attach(lambda _kind, _where: False)
    fill(part.world, cars)
    parts = [part, TrafficPart(city_map, policy=policy), MonitorPart(city_map)]
    with Lockstep(parts) as city:
        observed = Observed(city, part.world, observed_s) if observed_s else None
        city.run_for(1.0)
        count, at_s = Count(part.world, span_s), 0.0
        while at_s < span_s and count.took_s <= wall_s:
            city.run_for(LOOK_S)
            at_s += LOOK_S
            count.look(at_s, prints_progress=prints_progress)
            if observed is not None:
                observed.look(LOOK_S)
    return count.row(at_s), observed


def arguments() -> argparse.Namespace:
    """Return what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m bench.flow", description=__doc__)
    parser.add_argument("cities", nargs="*", default=list(MAPS), help="lights, signs, or a map")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--wall", type=float, default=math.inf, help="s of real time at most")
    parser.add_argument("--cars", type=int, default=200)
    parser.add_argument("--loss", type=float, default=0.0)
    parser.add_argument("--observe", type=float, default=0.0, help="s that the observer judges")
    parser.add_argument("--policy", default=FIXED, help="of all signals")
    parser.add_argument("--flash", action="store_true", help="all signals flash red")
    parser.add_argument("--progress", action="store_true")
    return parser.parse_args()


def main() -> None:
    """Print a table, a row a city."""
    given = arguments()
    print("| city | cars | hours | junctions passed an hour | in each quarter | fewest by a car "
          "| longest stand, s | contacts | x real time |")  # fmt: skip
    print("|---|---:|---:|---:|---:|---:|---:|---:|---:|")
    for city in given.cities:
        row, observed = flow(
            MAPS.get(city, city), given.cars, given.seconds, given.loss, given.wall,
            policy="flashing" if given.flash else given.policy,
            observed_s=given.observe, prints_progress=given.progress,
        )  # fmt: skip
        quarters = " ".join(f"{row[f'quarter{i}']:.0f}" for i in range(4) if f"quarter{i}" in row)
        print(
            f"| {city} | {row['cars']:.0f} | {row['hours']:.3f} | {row['passages_per_h']:.0f} "
            f"| {quarters} | {row['least']:.0f} | {row['longest_s']:.1f} | {row['contacts']:.0f} "
            f"| {row['ratio']:.1f} |",
            flush=True,
        )
        if observed is not None:
            found = ", ".join(f"{n} {kind}" for kind, n in observed.violations.items()) or "nothing"
            print(f"\nThe observer found, in {given.observe:.0f} s: {found}")
            print("\n".join(f"- {words}" for words in observed.words[:20]), flush=True)


if __name__ == "__main__":
    main()
