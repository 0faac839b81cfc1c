"""Throttle feedback: what the motor controller was last told, as a share of full throttle.

    value = min(1, max(-1, command))                                 + = forward

Holds: a controller that reports its set point; delays and losses behind it are the drive's.
Source: throttle sensor of the AutoDRIVE paper.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.sensor import Facts, Sensor, Sight, Truth


def facts(car: Car) -> Facts:
    """Return the device of a car file."""
    return Facts(
        rate_hz=car.value("throttle_feedback.rate_hz"),
        noise=(car.value("throttle_feedback.noise"),),
        latency_s=car.value("throttle_feedback.latency_s"),
        drop_out=car.value("throttle_feedback.drop_out"),
        quantum=car.value("throttle_feedback.quantum"),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Sight | None) -> Floats:
    """Return the throttle in [-1, 1], (k, 1)."""
    return np.clip(truth.throttle[rows], -1.0, 1.0)[:, None]


SENSOR = Sensor("throttle_feedback", ("throttle",), ("throttle_feedback.rate_hz",), facts, measure)
