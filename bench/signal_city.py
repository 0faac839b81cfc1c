"""Which policy when, in the whole city: cars that drive, hear and are heard, under each policy.

Run with `python -m bench.signal_city [CASE ...] [--seconds S] [--policies NAME ...]`. Delay is
what the way took beyond its time at the limit, for each junction passed; the first minute is left
out.
"""

import argparse
import time
from typing import NamedTuple

import numpy as np

from bench.city import fill
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.world.part import WorldPart

CASES = {
    "school, 2": ("driving_school", 2),
    "school, 8": ("driving_school", 8),
    "grid 3x3, 8": ("grid:3x3", 8),
    "grid 3x3, 30": ("grid:3x3", 30),
    "grid 5x5, 30": ("grid:5x5", 30),
    "grid 5x5, 100": ("grid:5x5", 100),
}
POLICIES = ("calm", "brisk", "actuated", "max_pressure")
WARM_S, LOOK_S, LIMIT_MPS = 60.0, 0.2, 0.25


class Row(NamedTuple):
    """What a city did under a policy."""

    speed_mps: float
    delay_s: float
    passed_per_h: float
    longest_s: float


def driven(name: str, cars: int, policy: str, span_s: float) -> Row:
    """Run a city for a while; `policy` is one, or a plan of fixed time."""
    city_map = load_map(name)
    is_plan = policy in ("calm", "brisk")
    part = WorldPart(city_map, room=cars)
    traffic = TrafficPart(
        city_map, policy if is_plan else None, policy="fixed" if is_plan else policy
    )
    world = part.world
    fill(world, cars)
    with Lockstep([part, traffic, MonitorPart(city_map)]) as city:
        city.run_for(WARM_S)
        before, way_m = world.drivers.passed.copy(), 0.0
        stood_s, longest_s = np.zeros(cars), 0.0
        for _ in range(round(span_s / LOOK_S)):
            city.run_for(LOOK_S)
            way_m += LOOK_S * float(np.abs(world.cars.arrays.speed[:cars]).sum())
            stands = np.abs(world.cars.arrays.speed[:cars]) < 0.01
            stood_s = np.where(stands, stood_s + LOOK_S, 0.0)
            longest_s = max(longest_s, float(stood_s.max()))
    passed = float((world.drivers.passed - before)[:cars].sum()) / 2.0
    return Row(
        way_m / cars / span_s,
        (cars * span_s - way_m / LIMIT_MPS) / max(passed, 1.0),
        passed / span_s * 3600.0,
        longest_s,
    )


def main() -> None:
    """Print a table, a row a policy."""
    parser = argparse.ArgumentParser(prog="python -m bench.signal_city", description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES), help=f"of {', '.join(CASES)}")
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--policies", nargs="*", default=POLICIES)
    given = parser.parse_args()
    print("| map, cars | policy | mean speed, m/s | delay a junction, s | junctions passed an hour "
          "| longest stand, s | took, s |")  # fmt: skip
    print("|---|---|---:|---:|---:|---:|---:|")
    for case in given.cases:
        name, cars = CASES[case]
        for policy in given.policies:
            began = time.perf_counter()
            row = driven(name, cars, policy, given.seconds)
            took = time.perf_counter() - began
            print(
                f"| {case} | {policy} | {row.speed_mps:.3f} | {row.delay_s:.1f} "
                f"| {row.passed_per_h:.0f} | {row.longest_s:.0f} | {took:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
