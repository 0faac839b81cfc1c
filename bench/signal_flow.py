"""Which policy when: cars on the lanes of a map under each policy, by the same controllers.

The cars here are points with a length: they keep to the lane's limit, to 0.5 m/s2, to 0.8 s behind
the car ahead and to the signals, as drivers do, and turn by chance. Detectors hear them once a
second and 0.1 s late, as CAMs come. It costs a hundredth of the world, so that many demands and
seeds can be driven. Run with `python -m bench.signal_flow [SECONDS]`.
"""

import random
import statistics
import sys
import time
from dataclasses import dataclass, field

from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.controller_state import Observations
from scm.traffic.signals.detectors import JunctionDetectors, Seen, reach_of
from scm.traffic.signals.junction_timings import timetables_of
from scm.traffic.signals.program import STEP_NS, program_of
from scm.traffic.signals.timing import NIGEL

DT_S = STEP_NS / NS_PER_S
DECEL, ACCEL, TIME_GAP_S, STAND_GAP_M, LENGTH_M, RANGE_M = 0.5, 0.5, 0.8, 0.12, 0.30, 2.0
CAM_EVERY, CAM_LATE, WARM_UP_S, FAVOUR = 10, 1, 100.0, 4.0

POLICIES = (("fixed", "calm"), ("fixed", "brisk"), ("actuated", "calm"), ("max_pressure", "calm"))
DEMANDS = {
    "driving_school": {"light": (2, False), "dense": (8, False), "uneven": (5, True)},
    "grid:3x3": {"light": (5, False), "dense": (30, False), "uneven": (15, True)},
}


@dataclass
class Car:
    """A point on a way; its front is `at_m` on the first lane."""

    who: int
    lanes: list[str]
    at_m: float
    speed_mps: float = 0.0
    way_m: float = 0.0
    stood_s: float = 0.0
    longest_s: float = 0.0
    stops: int = 0
    goes_on: str = ""
    delayed: list[Seen] = field(default_factory=list)


class Flow:
    """A map, its controllers, and cars."""

    def __init__(
        self, city_map: CityMap, policy: str, plan: str, cars: int, *, uneven: bool, seed: int,
        waves: bool = True,
    ) -> None:  # fmt: skip
        self.dice = random.Random(seed)
        self.roads = Roads(city_map)
        self.uneven = uneven
        programs = {j.name: program_of(j, self.roads) for j in city_map.junctions}
        tables = timetables_of(city_map, self.roads, programs, NIGEL)
        self.controllers = {
            name: Controller(
                name, program, plan, policy=policy, tables=tables[name] if waves else None
            )
            for name, program in programs.items()
        }
        self.watchers = {
            j.name: JunctionDetectors(j, self.roads, reach_of(programs[j.name], self.roads))
            for j in city_map.junctions
        }
        self.favoured = {
            line.name
            for line in city_map.stop_lines
            if list(programs[line.junction].groups).index(line.group)
            < (len(programs[line.junction].groups) + 1) // 2
        }
        spawns = list(city_map.spawns)
        self.dice.shuffle(spawns)
        self.cars = [Car(i, [s.lane], s.at_m) for i, s in enumerate(spawns[:cars])]
        self.now_ns = 0
        self.colours: dict[tuple[str, str], str] = {}

    def run(self, seconds: float) -> None:
        """Drive; ways and waits count after the warm-up."""
        for step in range(round(seconds / DT_S)):
            if step == round(WARM_UP_S / DT_S):
                for car in self.cars:
                    car.way_m = car.longest_s = 0.0
                    car.stops = 0
            self._signals()
            lanes: dict[str, list[Car]] = {}
            for car in self.cars:
                lanes.setdefault(car.lanes[0], []).append(car)
            for car in self.cars:
                self._drive(car, lanes)
            for car in self.cars:
                self._send_cam(car, step)
            self.now_ns += STEP_NS

    def _signals(self) -> None:
        for name, controller in self.controllers.items():
            watcher = self.watchers[name]
            observation = Observations({})
            if controller.needs_detectors:
                observation = Observations(watcher.by_group(watcher.read(self.now_ns)), sees=True)
            controller.step(self.now_ns, observation)
            for group in controller.spat(self.now_ns).groups:
                self.colours[name, group.group] = group.colour

    def _send_cam(self, car: Car, step: int) -> None:
        if (step + car.who * 3) % CAM_EVERY == 0:
            pose: Pose2 = self.roads.lane(car.lanes[0]).at(car.at_m)
            speed = car.speed_mps
            seen = Seen(car.who, self.now_ns, pose.x, pose.y, pose.yaw, speed, LENGTH_M)
            car.delayed.append(seen)
        if car.delayed and self.now_ns - car.delayed[0].t_ns >= CAM_LATE * STEP_NS:
            seen = car.delayed.pop(0)
            for name, watcher in self.watchers.items():
                if self.controllers[name].needs_detectors:
                    watcher.add(seen, self.now_ns)

    def _next_lane(self, lane: str) -> str:
        ways = self.roads.successors(lane)
        if not self.uneven or len(ways) == 1:
            return self.dice.choice(ways)
        weights = [FAVOUR if self._line_of(way) in self.favoured else 1.0 for way in ways]
        return self.dice.choices(ways, weights)[0]

    def _line_of(self, lane: str) -> str:
        for _ in range(8):
            lines = self.roads.stop_lines_on(lane)
            if lines:
                return str(lines[0].name)
            lane = self.roads.successors(lane)[0]
        return ""

    def _drive(self, car: Car, lanes: dict[str, list[Car]]) -> None:
        free_m, line_m, line = RANGE_M, RANGE_M, None
        begin, number = -car.at_m, 0
        while begin < RANGE_M:
            lane = car.lanes[number]
            for other in lanes.get(lane, []):
                gap = begin + other.at_m - LENGTH_M
                if other is not car and gap > -LENGTH_M:
                    free_m = min(free_m, gap)
            if line is None:
                line = next((n for n in self.roads.stop_lines_on(lane) if begin + n.at_m > 0), None)
                line_m = begin + line.at_m if line else RANGE_M
            begin += self.roads.length_of(lane)
            number += 1
            if number == len(car.lanes):
                car.lanes.append(self._next_lane(lane))
        speed = car.speed_mps
        limit = self.roads.definition(car.lanes[0]).speed_limit_mps
        gap_m = max(0.0, free_m - STAND_GAP_M)
        if free_m < RANGE_M:
            behind = lanes and (2.0 * DECEL * (gap_m + speed**2 / (2 * DECEL))) ** 0.5
            limit = min(limit, behind, gap_m / TIME_GAP_S)
        if line is not None:
            limit = min(limit, self._at_line(car, line, line_m))
        car.speed_mps = max(0.0, speed - 2.0 * DECEL * DT_S, min(limit, speed + ACCEL * DT_S))
        if free_m < 0.02:
            car.speed_mps = 0.0
        driven = car.speed_mps * DT_S
        car.at_m += driven
        car.way_m += driven
        self._count(car)
        if car.at_m >= self.roads.length_of(car.lanes[0]):
            car.at_m -= self.roads.length_of(car.lanes.pop(0))

    def _at_line(self, car: Car, line, line_m: float) -> float:
        colour = self.colours[line.junction, line.group]
        left_m = line_m - 0.04
        can_stop = left_m > car.speed_mps**2 / (2.0 * DECEL) + 0.1 * car.speed_mps
        if colour == "green" or (colour == "yellow" and (car.goes_on == line.name or not can_stop)):
            if not can_stop:
                car.goes_on = line.name
            return 10.0
        if car.goes_on == line.name and line_m < 0.02:
            return 10.0
        return max(0.0, 2.0 * DECEL * max(0.0, left_m - 0.1 * car.speed_mps)) ** 0.5

    @staticmethod
    def _count(car: Car) -> None:
        if car.speed_mps < 0.02:
            car.stops += car.stood_s == 0.0
            car.stood_s += DT_S
            car.longest_s = max(car.longest_s, car.stood_s)
        else:
            car.stood_s = 0.0

    def mean_mps(self, seconds: float) -> float:
        """Return the cars' mean speed."""
        return statistics.mean(car.way_m for car in self.cars) / (seconds - WARM_UP_S)


def main() -> None:
    """Print a table of mean speeds, with the spread over the seeds, and longest waits."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 300.0
    only = sys.argv[2:]
    print("| map | demand | policy | mean speed, m/s (three seeds) | longest wait, s |")
    print("|---|---|---|---|---|")
    for name, demands in DEMANDS.items():
        city_map = load_map(name)
        for demand, (cars, uneven) in demands.items():
            for policy, plan in POLICIES:
                if only and f"{name}/{policy}" not in only and name not in only:
                    continue
                speeds, waits, began = [], [], time.perf_counter()
                for seed in range(3):
                    flow = Flow(city_map, policy, plan, cars, uneven=uneven, seed=seed)
                    flow.run(seconds)
                    speeds.append(flow.mean_mps(seconds))
                    waits.append(max(car.longest_s for car in flow.cars))
                label = f"{policy} {plan}" if policy == "fixed" else policy
                spread = " ".join(f"{v:.3f}" for v in speeds)
                mean = statistics.mean(speeds)
                print(
                    f"| {name} | {demand}, {cars} | {label} | {mean:.3f} ({spread}) "
                    f"| {max(waits):.0f} |",
                    f"{time.perf_counter() - began:.0f} s" if sys.stdout.isatty() else "",
                    flush=True,
                )


if __name__ == "__main__":
    main()
