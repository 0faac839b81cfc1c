"""What the devices of 10 000 cars cost at 50 ticks a second, wanted by nobody and by everybody.

Run with `python -m bench sensors`. The limit beside each is what one generator call a car and
reading takes, as a device with a generator of its own would make it.
"""

import time

import numpy as np

from scm import registry
from scm.vehicles.bank import Bank
from scm.vehicles.car import load_car
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.sensor import Sensor

CARS, TICKS, TICK_NS = 10_000, 50, 20_000_000
PACKAGE = "scm.vehicles.sensors"


def second_of(bank: Bank, begin_ns: int) -> tuple[float, int]:
    """Return the processor time [s] of a second of ticks, and the readings that came out."""
    start, count = time.process_time(), 0
    for tick in range(TICKS):
        count += sum(len(r.indices) for r in bank.step(begin_ns + tick * TICK_NS))
    return time.process_time() - start, count


def main() -> None:
    """Print the table."""
    car, truth = load_car("nigel"), ExternalVehicles(CARS)
    rng = np.random.default_rng(0)
    generators = rng.spawn(200)
    print(f"{CARS} cars           unwanted     wanted   readings/s   own generators")
    for kind in registry.names(PACKAGE):
        if kind == "lidar":
            continue  # see bench/lidar.py
        bank = Bank(registry.load(PACKAGE, kind, "SENSOR", Sensor), 0, CARS)
        for vehicle in range(CARS):
            bank.fit(vehicle, f"n{vehicle}", car, truth, vehicle, 0)
        second_of(bank, 0)
        wanted, count = second_of(bank, TICKS * TICK_NS)
        bank.wanted[:] = False
        unwanted, _ = second_of(bank, 2 * TICKS * TICK_NS)
        start = time.process_time()
        for generator in generators:
            generator.standard_normal(len(bank.sensor.values))
        peer = (time.process_time() - start) / len(generators) * count
        print(f"{kind:20s} {100 * unwanted:8.2f} % {100 * wanted:8.1f} % {count:10d}"
              f" {100 * peer:12.1f} %", flush=True)  # fmt: skip
        del bank


if __name__ == "__main__":
    main()
