"""Encoders of the rear wheels: whole counts of the wheel angle since the car was placed.

    count = floor(angle * counts_per_revolution / (2 pi) + noise)    left, right; + = forward

Holds: quadrature counting without missed edges.
Source: 1920 counts a revolution, AutoDRIVE paper; simulator: 16 pulses through a 120:1 gear.
"""

import math

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.sensor import Facts, Sensor, Sight, Truth

REAR = (2, 3)


def facts(car: Car) -> Facts:
    """Return the device of a car file: whole counts."""
    return Facts(
        rate_hz=car.value("encoder.rate_hz"),
        noise=(car.value("encoder.noise_counts"),),
        latency_s=car.value("encoder.latency_s"),
        drop_out=car.value("encoder.drop_out"),
        quantum=1.0,
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Sight | None) -> Floats:
    """Return the angles of the rear wheels in counts, not yet rounded, (k, 2)."""
    counts = car.value("encoder.counts_per_revolution")
    return truth.wheel_angle[rows][:, REAR] * (counts / (2.0 * math.pi))


SENSOR = Sensor(
    "encoders",
    ("left_counts", "right_counts"),
    ("encoder.counts_per_revolution",),
    facts,
    measure,
)
