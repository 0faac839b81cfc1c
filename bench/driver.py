"""Microseconds a decision of the crowd driver, beside pure pursuit alone in the same run.

The limit is what nobody can do without: one compiled pure-pursuit update a car, on a path that is
already known, blind to signals and to everybody else. Run with `python -m bench driver`.
"""

import math
import time
from typing import Any

import numba
import numpy as np

from scm.arrays import Floats
from scm.maps.grid_city import grid_city
from scm.maps.route import Roads
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.lane_graph import lane_graph_of

NIGEL = CarLimits(
    wheelbase=0.14154, steer_limit=0.5235988, steer_rate=0.42, front=0.23, rear=0.07, width=0.175,
    speeds=(0.02867, 0.05685, 0.08457, 0.11185, 0.13871, 0.16516, 0.19122, 0.21688, 0.24215,
            0.26703),
)  # fmt: skip
SIZES = ((100, 4), (1_000, 8), (10_000, 20))  # cars, junctions along each side
TICK_NS = 20_000_000
SECONDS = 1.0


class Streaming:
    """Cars that fill a grid city at one a metre and drive as their drivers say, as bicycles."""

    def __init__(self, cars: int, side: int) -> None:
        city_map = grid_city(side, side, block_m=8.0 if side > 4 else 4.0)
        roads = Roads(city_map)
        self.drivers = DriverBatch(lane_graph_of(roads), cars)
        self.now_ns = 0
        self.driven = np.ones(cars, np.bool_)
        self.x, self.y, self.yaw, self.speed, self.angle = np.zeros((5, cars))
        rng = np.random.default_rng(0)
        places = [(s.lane or "", s.at_m or 0.0) for s in city_map.spawns]
        for row, at in enumerate(rng.choice(len(places), cars, replace=False)):
            lane, s = places[at]
            self.x[row], self.y[row], self.yaw[row] = roads.lane(lane).at(s)
            self.drivers.enter(row, NIGEL, seed=row)
            self.drivers.circulate(row, lane, s)
        self._rows = np.arange(cars)

    def receive_cams(self) -> None:
        """Let a tenth of the cars tell where they are, as about one in fifty ticks does."""
        rows = self._rows[(self.now_ns // TICK_NS) % 10 :: 10] if self.now_ns else self._rows
        front_x = self.x[rows] + NIGEL.front * np.cos(self.yaw[rows])
        front_y = self.y[rows] + NIGEL.front * np.sin(self.yaw[rows])
        motion = self.yaw[rows], self.speed[rows], np.zeros(len(rows))
        self.drivers.receive_cams(rows, self.now_ns, front_x, front_y, *motion)

    def decide(self) -> None:
        self.drivers.decide(self.now_ns, self.x, self.y, self.yaw, self.speed, self.driven)

    def move(self) -> None:
        self.now_ns += TICK_NS
        step = TICK_NS * 1e-9
        target = self.drivers.steering * NIGEL.steer_limit
        most = NIGEL.steer_rate * step
        self.angle += np.clip(target - self.angle, -most, most)
        self.speed += (0.267 * np.maximum(0.0, self.drivers.throttle) - self.speed) * 0.28
        self.x += self.speed * np.cos(self.yaw) * step
        self.y += self.speed * np.sin(self.yaw) * step
        self.yaw += self.speed * np.tan(self.angle) / NIGEL.wheelbase * step


@numba.njit(nogil=True)
def pursue(poses: Floats, aims: Floats, commands: Floats) -> None:
    """Steer each car towards a point that it is given, at a speed that it is given."""
    for car in range(len(poses)):
        dx, dy = aims[car, 0] - poses[car, 0], aims[car, 1] - poses[car, 1]
        away = math.sqrt(dx * dx + dy * dy) + 1e-9
        bearing = math.atan2(dy, dx) - poses[car, 2]
        commands[0, car] = min(1.0, max(0.0, 4.0 * (aims[car, 2] - poses[car, 3])))
        commands[1, car] = math.atan(2.0 * 0.14154 * math.sin(bearing) / away) / 0.5235988


def pursuit_us(cars: int) -> float:
    rng = np.random.default_rng(0)
    poses, aims, commands = rng.random((cars, 4)), rng.random((cars, 3)), np.zeros((2, cars))
    return _best_us(lambda: pursue(poses, aims, commands), cars)


def _best_us(work: Any, cars: int) -> float:
    """Return the least time a car of some repeats [us]: what disturbs only adds."""
    work()
    times, ends = [], time.perf_counter() + 0.3
    while time.perf_counter() < ends or len(times) < 5:
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / cars


def crowd_us(cars: int, side: int) -> tuple[float, float]:
    """Return the mean and the least time a decision [us] while the city drives."""
    city = Streaming(cars, side)
    times: list[float] = []
    ends = time.perf_counter() + SECONDS
    while time.perf_counter() < ends or len(times) < 100:
        city.receive_cams()
        start = time.perf_counter()
        city.decide()
        times.append(time.perf_counter() - start)
        city.move()
    steady = times[20:]
    return 1e6 * float(np.median(steady)) / cars, 1e6 * min(steady) / cars


def main() -> None:
    print("| cars | us a decision, median | least | pure pursuit alone, us | ratio |")
    print("| ---: | ---: | ---: | ---: | ---: |")
    for cars, side in SIZES:
        median, least = crowd_us(cars, side)
        limit = pursuit_us(cars)
        print(f"| {cars:,} | {median:.2f} | {least:.2f} | {limit:.3f} | {least / limit:.0f} |")


if __name__ == "__main__":
    main()
