"""Levels of service of a loaded crossing: uneven demand over the middle of a dense grid.

Run with `python -m bench.levels [--seconds S] [POLICY ...]`. Cars go straight over the middle of
`grid:3x3`, three times as many from west and east as from south and north, among others that
circulate. The observer counts by cameras' tracks; a table row for each approach to the middle.
"""

import argparse

from bench.city import fill
from bench.flow import Cameras
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.demand.part import DemandPart
from scm.traffic.demand.table import Flow
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.observation.part import ObserverPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.violation import Violation
from scm.world.part import WorldPart

MANY_PER_H, FEW_PER_H = 180.0, 60.0
WAYS = {
    ("j0_1_e", "j1_1_e"): MANY_PER_H,
    ("j2_1_w", "j1_1_w"): MANY_PER_H,
    ("j1_0_n", "j1_1_n"): FEW_PER_H,
    ("j1_2_s", "j1_1_s"): FEW_PER_H,
}
CIRCULATE = 15


def row_of(part: ObserverPart, lane: str, now_ns: int) -> str:
    """Return what was counted on an approach, as cells of a table."""
    counts = part.counters.counts(now_ns).approaches
    (row,) = (row for row in counts if row.lane == lane)
    delay = "-" if row.delay_s is None else f"{row.delay_s:.1f}"
    saturation = "-" if row.saturation is None else f"{row.saturation:.2f}"
    return (
        f"{row.passed} | {delay} | {row.stops:.2f} | {row.queue_most} | {saturation} | {row.level}"
    )


def main() -> None:
    """Print a table, a row an approach."""
    parser = argparse.ArgumentParser(prog="python -m bench.levels", description=__doc__)
    parser.add_argument("policies", nargs="*", default=["fixed", "actuated"])
    parser.add_argument("--seconds", type=float, default=300.0)
    given = parser.parse_args()
    city_map = load_map("grid:3x3")
    print("| policy | from | wanted an hour | passed | delay, s | stops | queue | saturation "
          "| level |")  # fmt: skip
    print("|---|---|---:|---:|---:|---:|---:|---:|---|")
    for policy in given.policies:
        flows = [Flow(a, b, per_h, 0.0, 3600.0, "nigel", 1) for (a, b), per_h in WAYS.items()]
        world = WorldPart(city_map, room=100)
        demand, observer = DemandPart(city_map, flows), ObserverPart(city_map)
        fill(world.world, CIRCULATE)
        signals = [TrafficPart(city_map, policy=policy), MonitorPart(city_map)]
        parts = [world, *signals, demand, Cameras(world.world), observer]
        with Lockstep(parts) as city:
            violations = city.subscribe(Subscription(Violation))
            city.run_for(given.seconds)
            for (lane, _), per_h in WAYS.items():
                cells = row_of(observer, lane, city.now_ns)
                print(f"| {policy} | {lane} | {per_h:.0f} | {cells} |", flush=True)
            violations = [item.message.text for item in violations.drain()]
        print(f"\n{policy}: {demand.status}; the observer reported {violations or 'nothing'}\n")


if __name__ == "__main__":
    main()
