"""Vehicle-steps per second of the car kernel, beside CommonRoad's multi-body model in the same run.

Run with `python bench/kernel.py`; the peer comes with `pip install commonroad-vehicle-models`.
Two threads are a thread pool that shares the fleet by rows: the kernel holds no interpreter lock.
"""

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet

STEPS = 10  # substeps a call, as the world does: 10 ms of 1 ms
REPEATS = 7
SECONDS = 0.12  # of work a repeat


class Rate(NamedTuple):
    """Steps per second of the clock, and per second of processor time: equal on a quiet machine."""

    clock: float
    processor: float


def rate(work: Callable[[], object], steps: int) -> Rate:
    """Return the median rates over some repeats of the work."""
    work()
    rates = []
    for _ in range(REPEATS):
        start, cpu, calls = time.perf_counter(), time.process_time(), 0
        while time.perf_counter() - start < SECONDS:
            work()
            calls += 1
        done = calls * steps
        rates.append(
            (done / (time.perf_counter() - start), done / max(time.process_time() - cpu, 1e-9))
        )
    return Rate(*(statistics.median(column) for column in zip(*rates, strict=True)))


def fleet_of(cars: int) -> Fleet:
    """Return Nigels that all drive in circles of different size."""
    fleet = Fleet(load_car("nigel"), cars)
    for row in range(cars):
        fleet.add(Pose2(float(row), 0.0, 0.0))
    fleet.throttle[:] = 0.6
    fleet.steering[:] = [0.9 * (row % 19 - 9) / 9 for row in range(cars)]
    fleet.advance(1.0)
    return fleet


def kernel_rate(cars: int, threads: int) -> Rate:
    fleet = fleet_of(cars)
    duration = STEPS * 1e-3
    if threads == 1:
        return rate(lambda: fleet.advance(duration), cars * STEPS)
    cuts = [cars * i // threads for i in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:

        def work() -> None:
            futures = [
                pool.submit(fleet.advance_rows, first, last, duration)
                for first, last in pairwise(cuts)
            ]
            for future in futures:
                future.result()

        return rate(work, cars * STEPS)


def peer_rate() -> Rate | None:
    """Return classic Runge-Kutta steps per second of the peer's multi-body car, or None."""
    try:
        from vehiclemodels.init_mb import init_mb
        from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
        from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
    except ImportError:
        return None
    p, u, dt = parameters_vehicle2(), [0.0, 0.5], 1e-3
    state = init_mb([0.0, 0.0, 0.05, 10.0, 0.0, 0.0, 0.0], p)

    def moved(x: list[float], k: list[float], h: float) -> list[float]:
        return [a + h * b for a, b in zip(x, k, strict=True)]

    def step() -> list[float]:
        k1 = vehicle_dynamics_mb(state, u, p)
        k2 = vehicle_dynamics_mb(moved(state, k1, dt / 2), u, p)
        k3 = vehicle_dynamics_mb(moved(state, k2, dt / 2), u, p)
        k4 = vehicle_dynamics_mb(moved(state, k3, dt), u, p)
        slopes = zip(k1, k2, k3, k4, strict=True)
        return moved(state, [a + 2 * b + 2 * c + d for a, b, c, d in slopes], dt / 6)

    return rate(step, 1)


def main() -> None:
    start = time.perf_counter()
    Fleet(load_car("nigel"), 1)
    print(f"kernel ready after {time.perf_counter() - start:.2f} s (numba already imported)\n")
    peer = peer_rate()
    print("| what | cars | threads | steps/s | steps/s of processor time | beside the peer |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    if peer is None:
        print("| CommonRoad multi-body, RK4: not installed | | | | | |")
    else:
        print(f"| CommonRoad multi-body, RK4 (29 states) | 1 | 1 | {_cells(peer, peer)} |")
    for cars in (1, 100, 10_000):
        for threads in (1, 2):
            if threads <= cars:
                what = f"scm 14-DOF, {STEPS} substeps a call | {cars:,} | {threads}"
                print(f"| {what} | {_cells(kernel_rate(cars, threads), peer)} |")


def _cells(own: Rate, peer: Rate | None) -> str:
    ratio = f"{own.processor / peer.processor:,.0f}" if peer else "-"
    return f"{own.clock:,.0f} | {own.processor:,.0f} | {ratio}"


if __name__ == "__main__":
    main()
