"""Drive a car of one's own, with an effect of one's own, and see what the effect does.

`buggy.toml` is the car, `carpet_nap.py` the effect that it lists; both are files beside this one.
Run: python examples/own_car/drive.py
"""

from pathlib import Path

import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import Car, load_car
from scm.vehicles.fleet import Fleet

CAR = Path(__file__).with_name("buggy.toml")


def speeds_in_a_circle(car: Car) -> tuple[float, float]:
    """Return the slowest and the fastest speed of a steady circle [m/s]."""
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0], fleet.steering[0] = 0.5, 0.6
    fleet.advance(5.0)
    speeds = []
    for _ in range(500):
        fleet.advance(0.01)
        speeds.append(float(fleet.speed[0]))
    return float(np.min(speeds)), float(np.max(speeds))


def main() -> None:
    buggy = load_car(CAR)
    for label, coefficient in (("with the nap", 1.5), ("without it", 0.0)):
        car = buggy.with_terms([], {"carpet_nap.coefficient_ns_m": coefficient})
        slowest, fastest = speeds_in_a_circle(car)
        print(f"{label:<13} {slowest:.3f} to {fastest:.3f} m/s")


if __name__ == "__main__":
    main()
