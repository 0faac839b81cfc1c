"""Indoor positioning: where the tag on the roof is, and which way it looks, in the map frame.

    (x, y) = (x, y of the body's origin) + R(yaw) (T(roll, pitch) p)_xy        yaw = yaw of the body

p is the tag's place on the body, T tilts it with the body: a tag up high moves as the car leans.
Holds: a tag fixed to the sprung body; small roll and pitch.
Source: AutoDRIVE simulator (IPS as an exact transform); noise and delay from the car file.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.sensor import Facts, Sensor, Sight, Truth


def facts(car: Car) -> Facts:
    """Return the device of a car file."""
    place, angle = car.value("ips.noise_m"), car.value("ips.noise_rad")
    return Facts(
        rate_hz=car.value("ips.rate_hz"),
        noise=(place, place, angle),
        latency_s=car.value("ips.latency_s"),
        drop_out=car.value("ips.drop_out"),
        angles=(2,),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Sight | None) -> Floats:
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


SENSOR = Sensor("ips", ("x_m", "y_m", "yaw_rad"), ("ips.position_m",), facts, measure)
