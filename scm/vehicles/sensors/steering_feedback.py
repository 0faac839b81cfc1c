"""Steering feedback: the mean angle of the front wheels from the servo's own sensor.

    value = steer_angle + bias + noise                               + = left

Holds: no play between the sensor and the wheels; play is an effect of the steering.
Source: steering sensor of the AutoDRIVE paper.
"""

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import FileKey, device_keys
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth

KEYS = {
    **device_keys("steering_feedback"),
    "steering_feedback.noise_rad": FileKey("rad", 1, (0.0, 1.0), default=0.0),
    "steering_feedback.bias_rad": FileKey("rad", 1, (-1.0, 1.0), default=0.0),
    "steering_feedback.quantum_rad": FileKey("rad", 1, (0.0, 1.0), default=0.0),
}


def device(car: Car) -> Device:
    """Return the device's properties from a car file."""
    return Device(
        rate_hz=car.value("steering_feedback.rate_hz"),
        noise=(car.value("steering_feedback.noise_rad"),),
        latency_s=car.value("steering_feedback.latency_s"),
        drop_out=car.value("steering_feedback.drop_out"),
        quantum=car.value("steering_feedback.quantum_rad"),
        bias=(car.value("steering_feedback.bias_rad"),),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return the mean road-wheel angle (k, 1) [rad]."""
    return truth.steer_angle[rows][:, None]


def fields(readings: Floats) -> dict[str, list[float]]:
    """Return the reading as a message field."""
    return {"steering_rad": readings[:, 0].tolist()}


SENSOR = Sensor(
    "steering_feedback", ("steering_rad",), ("steering_feedback.rate_hz",), device, measure, fields
)
