"""Speed advice for green lights beside the same city without it: stops, time, energy, evenness.

Run with `python -m bench glosa [MAP ...] --seconds S`. Hosted cars circulate on a grid of lights in
lockstep, each city twice with the same seed: drivers that read SPATEM for speed, and drivers that
do not. Ratios are with over without. A stop is a car that had driven and stands, whatever for;
energy is what speeding up takes, a kilogram and metre; evenness is the variance of speed.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from bench.city import fill
from bench.flow import counted
from scm.arrays import Bools, Floats
from scm.maps.load import load_map
from scm.records.city_map import CityMap, RadioChannel
from scm.runtime.lockstep import Lockstep
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.policy import FIXED
from scm.world.part import WorldPart

MAPS = ("grid:4x4:4",)
LOSSES = (0.0, 0.3, 0.9)
LOOK_S, WARM_UP_S = 0.1, 20.0
STANDS_MPS, DRIVES_MPS = 0.01, 0.05


@dataclass
class Tally:
    """What the cars of one city did, added up over all of them."""

    stops: int = 0
    standing_s: float = 0.0
    metres: float = 0.0
    seconds: float = 0.0
    energy_j_kg: float = 0.0
    squares: float = 0.0
    contacts: int = 0
    lines: float = 0.0

    def row(self) -> dict[str, float]:
        """Return what is compared."""
        mean = self.metres / self.seconds
        return {
            "stops for 10 m": 10.0 * self.stops / self.metres,
            "standing, share": self.standing_s / self.seconds,
            "mean speed, m/s": mean,
            "energy, J/kg/m": self.energy_j_kg / self.metres,
            "variance, (m/s)2": self.squares / self.seconds - mean * mean,
            "junctions an hour": 3600.0 * self.lines,
            "contacts": float(self.contacts),
        }


class Watch:
    """Looks at the cars from time to time."""

    def __init__(self, hosted: Bools, speed: Floats) -> None:
        self.tally, self._hosted, self._before = Tally(), hosted, speed[hosted].copy()
        self._drove = self._before > DRIVES_MPS

    def look(self, speed: Floats) -> None:
        """Take note of all speeds, `LOOK_S` after the last time."""
        now, tally = np.maximum(speed[self._hosted], 0.0), self.tally
        stands = now < STANDS_MPS
        tally.stops += int((stands & self._drove).sum())
        self._drove = (self._drove & ~stands) | (now > DRIVES_MPS)
        tally.standing_s += LOOK_S * float(stands.sum())
        tally.metres += LOOK_S * float(now.sum())
        tally.seconds += LOOK_S * len(now)
        tally.squares += LOOK_S * float((now * now).sum())
        gained = 0.5 * (now * now - self._before * self._before)
        tally.energy_j_kg += float(np.maximum(gained, 0.0).sum())
        self._before = now


def drive(city_map: CityMap, cars: int, span_s: float, policy: str, seed: int) -> Tally:
    """Run one city; return what its cars did after the first seconds."""
    part = WorldPart(city_map, seed, room=cars)
    part.attach(lambda _kind, _where: False)
    world, drivers = part.world, part.world.drivers
    touched = counted(world)
    fill(world, cars)
    with Lockstep([part, TrafficPart(city_map, policy=policy), MonitorPart(city_map)]) as city:
        city.run_for(WARM_UP_S)
        watch, passed = (
            Watch(world.cars.arrays.hosted.copy(), world.cars.arrays.speed),
            drivers.passed.sum(),
        )
        for _ in range(round(span_s / LOOK_S)):
            city.run_for(LOOK_S)
            watch.look(world.cars.arrays.speed)
    watch.tally.contacts = len(touched.began)
    watch.tally.lines = float(drivers.passed.sum() - passed) / 2.0 / span_s
    return watch.tally


def compare(given: argparse.Namespace, name: str, loss: float) -> None:
    """Print the rows of one city."""
    city_map = replace(load_map(name), radio=RadioChannel(loss=loss))
    rows = []
    for is_advised in (False, True):
        changed = replace(city_map, speed_advice=is_advised)
        rows.append(drive(changed, given.cars, given.seconds, given.policy, given.seed).row())
    without, with_it = rows
    if loss == LOSSES[0]:
        print(f"| city, loss | advice | {' | '.join(without)} |")
        print("|---|---|" + "---:|" * len(without))
    for word, row in (("without", without), ("with", with_it)):
        cells = " | ".join(f"{value:.4g}" for value in row.values())
        print(f"| {name}, {loss:g} | {word} | {cells} |")
    ratios = (with_it[key] / max(without[key], 1e-12) for key in without if key != "contacts")
    print(f"| {name}, {loss:g} | ratio | {' | '.join(f'{r:.3f}' for r in ratios)} | |", flush=True)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m bench glosa", description=__doc__)
    parser.add_argument("cities", nargs="*", default=list(MAPS), help="maps with lights")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--cars", type=int, default=40)
    parser.add_argument("--policy", default=FIXED)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--loss", type=float, nargs="*", default=LOSSES)
    given = parser.parse_args()
    for city in given.cities:
        for loss in given.loss:
            compare(given, city, loss)


if __name__ == "__main__":
    main()
