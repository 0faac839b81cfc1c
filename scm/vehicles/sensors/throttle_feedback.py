"""Throttle feedback: the motor controller's set point, as a share of full throttle.

    value = min(1, max(-1, command))                                 + = forward

Holds: a controller that reports its set point; delays and losses after it belong to the drive.
Source: throttle sensor of the AutoDRIVE paper.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import FileKey, device_keys
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth

KEYS = {
    **device_keys("throttle_feedback"),
    "throttle_feedback.noise": FileKey("1", 1, (0.0, 1.0), default=0.0),
    "throttle_feedback.quantum": FileKey("1", 1, (0.0, 1.0), default=0.0),
}


def device(car: Car) -> Device:
    """Return the device's properties from a car file."""
    return Device(
        rate_hz=car.value("throttle_feedback.rate_hz"),
        noise=(car.value("throttle_feedback.noise"),),
        latency_s=car.value("throttle_feedback.latency_s"),
        drop_out=car.value("throttle_feedback.drop_out"),
        quantum=car.value("throttle_feedback.quantum"),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return the throttle in [-1, 1], (k, 1)."""
    return np.clip(truth.throttle[rows], -1.0, 1.0)[:, None]


def fields(readings: Floats) -> dict[str, list[float]]:
    """Return the reading as a message field."""
    return {"throttle": readings[:, 0].tolist()}


SENSOR = Sensor(
    "throttle_feedback", ("throttle",), ("throttle_feedback.rate_hz",), device, measure, fields
)
