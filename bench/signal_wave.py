"""Green waves: cars along corridors of lights, with offsets between junctions and without.

Run with `python -m bench.signal_wave [SECONDS]`. Cars drive straight on wherever they can, so on a
grid of two rows they go round it: along one row of four lights, and back along the other.
"""

import statistics
import sys

from bench.signal_flow import WARM_UP_S, Car, Flow
from scm.geometry import wrap_angle
from scm.maps.load import load_map

MAP, CARS, SEEDS = "grid:6x2", 6, range(3)


class Corridor(Flow):
    """Cars that do not turn where they need not; `way_round` is + for those against the clock."""

    def _next_lane(self, lane: str) -> str:
        return min(self.roads.successors(lane), key=self._bend)

    def _bend(self, lane: str) -> float:
        path = self.roads.lane(lane)
        return abs(wrap_angle(path.at(path.length_m).yaw - path.at(0.0).yaw))

    def way_round(self, car: Car) -> int:
        """Return +1 for a car that goes round against the clock, -1 for the others."""
        turned = 0.0
        lane = car.lanes[0]
        for _ in range(20):
            path = self.roads.lane(lane)
            turned += wrap_angle(path.at(path.length_m).yaw - path.at(0.0).yaw)
            lane = self._next_lane(lane)
        return 1 if turned > 0.0 else -1


def main() -> None:
    """Print travel time and stops per 10 m, for each way round."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 400.0
    city_map = load_map(MAP)
    print("| plan | offsets | way round | s for 10 m | stops in 10 m |\n|---|---|---|---|---|")
    for plan in ("calm", "brisk"):
        for waves in (True, False):
            found: dict[int, list[tuple[float, float]]] = {1: [], -1: []}
            for seed in SEEDS:
                flow = Corridor(
                    city_map, "fixed", plan, CARS, uneven=False, seed=seed, waves=waves
                )  # fmt: skip
                flow.run(seconds)
                for car in flow.cars:
                    took_s = (seconds - WARM_UP_S) / max(car.way_m, 0.1) * 10.0
                    found[flow.way_round(car)].append((took_s, car.stops / car.way_m * 10.0))
            for way, rows in found.items():
                took = statistics.mean(row[0] for row in rows) if rows else float("nan")
                stops = statistics.mean(row[1] for row in rows) if rows else float("nan")
                print(
                    f"| {plan} | {'with' if waves else 'without'} | {way:+d} ({len(rows)} cars) "
                    f"| {took:.0f} | {stops:.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
