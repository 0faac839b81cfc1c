"""Encoders of the rear wheels: whole counts of the wheel angle since the car was placed.

    count = floor(angle * counts_per_revolution / (2 pi) + noise)    left, right; + = forward

Holds: quadrature counting without missed edges.
Source: 1920 counts a revolution, AutoDRIVE paper; simulator: 16 pulses through a 120:1 gear.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import FileKey, device_keys
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth

REAR = (2, 3)

KEYS = {
    **device_keys("encoder", rate_hz=50.0),
    "encoder.counts_per_revolution": FileKey("1", 1, (1.0, 1e6)),
    "encoder.noise_counts": FileKey("1", 1, (0.0, 1e4), default=0.0),
}


def device(car: Car) -> Device:
    """Return the device's properties from a car file: whole counts."""
    return Device(
        rate_hz=car.value("encoder.rate_hz"),
        noise=(car.value("encoder.noise_counts"),),
        latency_s=car.value("encoder.latency_s"),
        drop_out=car.value("encoder.drop_out"),
        quantum=1.0,
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return the angles of the rear wheels in counts, not yet rounded, (k, 2)."""
    counts = car.value("encoder.counts_per_revolution")
    return truth.wheel_angle[rows][:, REAR] * (counts / (2.0 * math.pi))


def fields(readings: Floats) -> dict[str, list[int]]:
    """Return the counts as message fields."""
    left, right = readings.astype(np.int64).T.tolist()
    return {"encoder_left": left, "encoder_right": right}


SENSOR = Sensor(
    "encoders",
    ("left_counts", "right_counts"),
    ("encoder.counts_per_revolution",),
    device,
    measure,
    fields,
)
