"""Vehicle-steps per second of the car kernel, beside its limits and its peers in the same run.

Run with `python -m bench kernel`. Peers: the same laws as one numba loop over cars, and
CommonRoad's multi-body model (`pip install commonroad-vehicle-models`). Limit: what this core
multiplies and adds. Rates are per second of processor time, so a busy neighbour does not count;
two threads go by the clock.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.compiler.kernel_file import compile_kernel
from scm.vehicles.fleet import Fleet

STEPS = 10  # substeps a call, as the world does: 10 ms of 1 ms
REPEATS = 7
SECONDS = 0.12  # of work a repeat
START = (
    "from scm.vehicles.car import load_car; from scm.vehicles.fleet import Fleet; "
    "from scm.geometry import Pose2; fleet = Fleet(load_car('nigel'), 16); "
    "fleet.add(Pose2(0.0, 0.0, 0.0)); fleet.advance(0.01)"
)


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
    fleet.advance(0.5)
    return fleet


def kernel_rate(cars: int, *, threads: int = 1, plain: bool = False) -> Rate:
    """Rate of a fleet; `plain` is the same laws as one loop over cars."""
    fleet = fleet_of(cars)
    fleet.threads = threads
    if plain:
        fleet._kernel = compile_kernel(fleet.car.terms, plain=True)  # noqa: SLF001
    return rate(lambda: fleet.advance(STEPS * 1e-3), cars * STEPS)


def rollout_rate(cars: int) -> Rate:
    """Rate of a batch of parameter sets over a recording of 5 s at 50 Hz."""
    fleet = fleet_of(cars)
    throttle = 0.5 + 0.4 * np.sin(np.arange(250) * 0.05)
    return rate(lambda: fleet.rollout(throttle, 0.3 * throttle, 0.02), cars * 250 * 20)


@numba.njit(fastmath={"contract"})
def _multiply_and_add(rounds: int) -> float:
    sums = np.arange(96.0)
    for _ in range(rounds):
        for i in range(96):
            sums[i] = sums[i] * 0.999 + 0.001
    return sums.sum()


def peak_rate() -> Rate:
    """Floating-point operations per second of this core: twelve chains of eight lanes."""
    return rate(lambda: _multiply_and_add(20_000), 20_000 * 96 * 2)


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


def starts() -> list[tuple[float, float]]:
    """Seconds, of the clock and of the processor, until a process has made its first substep.

    Once with nothing compiled, once with all compiled.
    """
    took = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
            environment: dict[str, Any] = {**os.environ, "SCM_CACHE_DIR": folder}
            subprocess.run([sys.executable, "-c", START], env=environment, check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            worked = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            took.append((time.perf_counter() - begin, worked))
    return took


def main() -> None:
    peer, plain = peer_rate(), kernel_rate(1000, plain=True)
    rows = [
        ("same laws, one numba loop over cars", "1,000", plain),
        ("scm, tiles", "1", kernel_rate(1)),
        ("scm, batch of parameter sets over a recording", "64", rollout_rate(64)),
        ("scm, tiles", "100", kernel_rate(100)),
        ("scm, tiles", "1,000", kernel_rate(1000)),
        ("scm, tiles", "10,000", kernel_rate(10_000)),
    ]
    print("| what | cars | steps/s of one core | beside the loop | beside CommonRoad |")
    print("|---|---:|---:|---:|---:|")
    if peer is None:
        print("| CommonRoad multi-body: not installed | | | | |")
    else:
        print(f"| CommonRoad multi-body, 29 states, RK4 | 1 | {peer.processor:,.0f} | | 1 |")
    for what, cars, own in rows:
        beside = f"{own.processor / peer.processor:,.0f}" if peer else "-"
        ratio = own.processor / plain.processor
        print(f"| {what} | {cars} | {own.processor:,.0f} | {ratio:.1f} | {beside} |")
    one, two = kernel_rate(10_000), kernel_rate(10_000, threads=2)
    print(f"\ntwo threads, 10,000 cars, by the clock: {two.clock / one.clock:.2f} times one")
    print(f"this core at most: {peak_rate().processor / 1e9:.0f} GFLOP/s, multiply and add fused")
    print(f"memory: {fleet_of(1600).bytes_per_car} bytes a car")
    for name, (clock, processor) in zip(("cold", "warm"), starts(), strict=True):
        print(f"start to the first substep, {name}: {clock:.1f} s, {processor:.1f} s of processor")


if __name__ == "__main__":
    main()
