"""LIDAR: ranges to walls, boxes and cars, counter-clockwise about the scanner.

    beam i looks at  first + i * field_of_view / beams  from straight ahead, + = left

A full circle starts straight ahead, a narrower field of view at its right-hand end. Ray casting is
in `scm/vehicles/rays/cast.py`; with `sweep = "moving"` each beam has its own time and the car's
place at that time, `scm/vehicles/rays/march.py`. Readings below or above the range are misses.
Holds: a level scanner, infinitely high faces, all cars at their places at the reading's instant.
Source: AutoDRIVE simulator (7 Hz, 0.15 to 12 m, 360 beams, miss = infinity, beam 0 ahead,
counter-clockwise); noise from the paper's variability test.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import POSITION, FileKey, device_keys
from scm.vehicles.rays.cast import cast
from scm.vehicles.rays.march import march
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth

NOISE_SPREADS = 6.0

KEYS = {
    **device_keys("lidar"),
    "lidar.position_m": POSITION,
    "lidar.beams": FileKey("1", 1, (1.0, 10000.0)),
    "lidar.field_of_view_rad": FileKey("rad", 1, (0.01, 6.2831854), default=2.0 * math.pi),
    "lidar.range_m": FileKey("m", 2, (0.0, 200.0)),
    "lidar.noise_m": FileKey("m", 1, (0.0, 1.0)),
    "lidar.quantum_m": FileKey("m", 1, (0.0, 1.0), default=0.0),
    "lidar.sweep": FileKey("", 0, words=("frozen", "moving"), default="frozen"),
}


class Bearings(NamedTuple):
    """Directions of the beams: beam i at `first + i * step` from straight ahead, + = left [rad]."""

    first: float
    step: float
    beams: int


def bearings_of(car: Car) -> Bearings:
    """Return the beams of a car's device: a full circle starts ahead, a narrower view at its right.

    The last beam of a narrow field of view is one step short of its left end.
    """
    view, count = car.value("lidar.field_of_view_rad"), int(car.value("lidar.beams"))
    whole = view > 2.0 * math.pi - 1e-6
    return Bearings(0.0 if whole else -0.5 * view, view / count, count)


def sweep_s(car: Car) -> float:
    """Return the time of a car's device from its first beam to one past its last; 0: none."""
    if car.text("lidar.sweep") == "frozen":
        return 0.0
    _, step, beams = bearings_of(car)
    return beams * step / (2.0 * math.pi) / car.value("lidar.rate_hz")


def device(car: Car) -> Device:
    """Return the device's properties from a car file."""
    nearest, farthest = car.vector("lidar.range_m")
    return Device(
        rate_hz=car.value("lidar.rate_hz"),
        noise=(car.value("lidar.noise_m"),),
        latency_s=car.value("lidar.latency_s"),
        drop_out=car.value("lidar.drop_out"),
        quantum=car.value("lidar.quantum_m"),
        seen=(nearest, farthest),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return ranges (k, beams) [m]; infinity is a miss.

    The limits of the range are applied to the noisy readings, since noise may carry a hit beyond
    them.
    """
    bearings = bearings_of(car)
    if around is None:
        return np.full((len(rows), bearings.beams), np.inf)
    farthest = car.vector("lidar.range_m")[1] + NOISE_SPREADS * car.value("lidar.noise_m")
    x, y, _ = car.vector("lidar.position_m")
    yaw = truth.yaw[rows]
    c, s = np.cos(yaw), np.sin(yaw)
    scanners = np.column_stack((truth.x[rows] + c * x - s * y, truth.y[rows] + s * x + c * y, yaw))
    if car.text("lidar.sweep") == "frozen":
        return cast(around.scene, scanners, around.own, bearings, farthest)
    rate = truth.yaw_rate[rows]
    motion = np.column_stack(
        (truth.speed[rows] - rate * y, truth.lateral_speed[rows] + rate * x, rate)
    )
    period = 1.0 / car.value("lidar.rate_hz")
    return march(around.scene, scanners, motion, around.own, bearings, farthest, period)


def scan(car: Car, scanners: Floats, around: Surroundings) -> Floats:
    """Return the noiseless ranges of this car's scanner at rest at poses (k, 3)."""
    nearest, farthest = car.vector("lidar.range_m")
    ranges = cast(around.scene, scanners, around.own, bearings_of(car), farthest)
    ranges[ranges < nearest] = np.inf
    return ranges


SENSOR = Sensor(
    "lidar",
    ("range_m",),
    ("lidar.position_m", "lidar.rate_hz", "lidar.beams", "lidar.range_m", "lidar.noise_m"),
    device,
    measure,
)
