"""Indoor positioning: pose of the tag on the roof in the map frame.

    (x, y) = (x, y of the body's origin) + R(yaw) (T(roll, pitch) p)_xy        yaw = yaw of the body

p is the tag's place on the body, T tilts it with the body: a high tag moves when the car rolls.
Holds: a tag fixed to the sprung body; small roll and pitch.
Source: AutoDRIVE simulator (IPS as an exact transform); noise and delay from the car file.
"""

from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import POSITION, FileKey, device_keys
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth

KEYS = {
    **device_keys("ips", rate_hz=30.0),
    "ips.position_m": POSITION,
    "ips.noise_m": FileKey("m", 1, (0.0, 1.0), default=0.0),
    "ips.noise_rad": FileKey("rad", 1, (0.0, 1.0), default=0.0),
    "ips.tag_family": FileKey("", 0),
    "ips.tag_id": FileKey("1", 1, (0.0, 586.0)),
    "ips.tag_size_m": FileKey("m", 1, (0.001, 2.0)),
    "ips.map_tag_id": FileKey("1", 1, (0.0, 1e6)),
}


def device(car: Car) -> Device:
    """Return the device's properties from a car file."""
    place, angle = car.value("ips.noise_m"), car.value("ips.noise_rad")
    return Device(
        rate_hz=car.value("ips.rate_hz"),
        noise=(place, place, angle),
        latency_s=car.value("ips.latency_s"),
        drop_out=car.value("ips.drop_out"),
        angles=(2,),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return the tag's pose (k, 3): x, y [m], yaw [rad]."""
    x, y, z = car.vector("ips.position_m")
    yaw, roll, pitch = truth.yaw[rows], truth.roll[rows], truth.pitch[rows]
    raised = np.cos(roll) * z + np.sin(roll) * y
    ahead = np.cos(pitch) * x + np.sin(pitch) * raised
    left = np.cos(roll) * y - np.sin(roll) * z
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack(
        (truth.x[rows] + c * ahead - s * left, truth.y[rows] + s * ahead + c * left, yaw)
    )


def fields(readings: Floats) -> dict[str, list[Any]]:
    """Return the pose as message fields."""
    places = list(map(tuple, readings[:, :2].tolist()))
    return {"ips_m": places, "ips_yaw_rad": readings[:, 2].tolist()}


SENSOR = Sensor("ips", ("x_m", "y_m", "yaw_rad"), ("ips.position_m",), device, measure, fields)
