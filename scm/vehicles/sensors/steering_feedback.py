"""Steering feedback: the mean angle of the front wheels, as the servo's own sensor gives it.

    value = steer_angle + bias + noise                               + = left

Holds: no play between the sensor and the wheels; play is an effect of the steering.
Source: steering sensor of the AutoDRIVE paper.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.sensor import Facts, Sensor, Sight, Truth


def facts(car: Car) -> Facts:
    """Return the device of a car file."""
    return Facts(
        rate_hz=car.value("steering_feedback.rate_hz"),
        noise=(car.value("steering_feedback.noise_rad"),),
        latency_s=car.value("steering_feedback.latency_s"),
        drop_out=car.value("steering_feedback.drop_out"),
        quantum=car.value("steering_feedback.quantum_rad"),
        bias=(car.value("steering_feedback.bias_rad"),),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Sight | None) -> Floats:
    """Return the mean road-wheel angle (k, 1) [rad]."""
    return truth.steer_angle[rows][:, None]


SENSOR = Sensor(
    "steering_feedback", ("steering_rad",), ("steering_feedback.rate_hz",), facts, measure
)
