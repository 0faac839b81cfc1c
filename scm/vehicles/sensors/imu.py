"""IMU: specific force and angular rate at its place on the body, and the body's orientation.

    f = R^T (a_cog + a_impact + g z) + alpha x r + omega x (omega x r)    x forward, y left, z up
    gyro = omega                                                     roll, pitch, yaw rate
    orientation = roll, pitch, yaw                                   yaw from the map's x axis

r is the vector from the centre of gravity to the IMU, R tilts the level frame by pitch, then roll.
The last three are the estimate of a nine-axis unit. Contacts add their mean acceleration over the
last tick.
Holds: rigid mounting, small roll and pitch; a uniform magnetic field.
Source: rigid-body kinematics; noise of the MPU-9250's class, from the car file.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import Car
from scm.vehicles.car_file_schema import POSITION, FileKey, device_keys
from scm.vehicles.sensor import Device, Sensor, Surroundings, Truth
from scm.vehicles.shape import shape_of

KEYS = {
    **device_keys("imu"),
    "imu.position_m": POSITION,
    "imu.accel_noise_m_s2": FileKey("m/s^2", 1, (0.0, 10.0)),
    "imu.accel_bias_m_s2": FileKey("m/s^2", 3, (-10.0, 10.0), default=(0.0, 0.0, 0.0)),
    "imu.accel_walk_m_s2_sqrt_s": FileKey("m/s^2/s^0.5", 1, (0.0, 1.0), default=0.0),
    "imu.accel_limit_m_s2": FileKey("m/s^2", 1, (1.0, 1e6), default=1e6),
    "imu.gyro_noise_rad_s": FileKey("rad/s", 1, (0.0, 5.0)),
    "imu.gyro_bias_rad_s": FileKey("rad/s", 3, (-5.0, 5.0), default=(0.0, 0.0, 0.0)),
    "imu.gyro_walk_rad_s_sqrt_s": FileKey("rad/s/s^0.5", 1, (0.0, 1.0), default=0.0),
    "imu.gyro_limit_rad_s": FileKey("rad/s", 1, (0.1, 1e6), default=1e6),
    "imu.orientation_noise_rad": FileKey("rad", 1, (0.0, 1.0), default=0.0),
    "imu.heading_bias_rad": FileKey("rad", 1, (-4.0, 4.0), default=0.0),
    "imu.heading_walk_rad_sqrt_s": FileKey("rad/s^0.5", 1, (0.0, 1.0), default=0.0),
}


def device(car: Car) -> Device:
    """Return the device's properties from a car file."""
    value, vector = car.value, car.vector
    accel, gyro = value("imu.accel_noise_m_s2"), value("imu.gyro_noise_rad_s")
    accel_walk, gyro_walk = value("imu.accel_walk_m_s2_sqrt_s"), value("imu.gyro_walk_rad_s_sqrt_s")
    heading_walk = value("imu.heading_walk_rad_sqrt_s")
    return Device(
        rate_hz=value("imu.rate_hz"),
        latency_s=value("imu.latency_s"),
        drop_out=value("imu.drop_out"),
        noise=(accel,) * 3 + (gyro,) * 3 + (value("imu.orientation_noise_rad"),) * 3,
        bias=(
            *vector("imu.accel_bias_m_s2"), *vector("imu.gyro_bias_rad_s"),
            0.0, 0.0, value("imu.heading_bias_rad"),
        ),
        walk=(accel_walk,) * 3 + (gyro_walk,) * 3 + (0.0, 0.0, heading_walk),
        saturates_at=(
            *(value("imu.accel_limit_m_s2"),) * 3, *(value("imu.gyro_limit_rad_s"),) * 3,
            *(math.inf,) * 3,
        ),
        angles=(6, 7, 8),
    )  # fmt: skip


def measure(car: Car, truth: Truth, rows: Ints, around: Surroundings | None) -> Floats:
    """Return specific force [m/s^2], angular rate [rad/s] and orientation [rad], (k, 9)."""
    level = np.column_stack(
        (
            truth.accel_x[rows] + truth.contact_accel_x[rows],
            truth.accel_y[rows] + truth.contact_accel_y[rows],
            truth.accel_z[rows] + GRAVITY,
        )
    )
    roll, pitch = truth.roll[rows], truth.pitch[rows]
    force = tilted(level, roll, pitch)
    omega = np.column_stack((truth.roll_rate[rows], truth.pitch_rate[rows], truth.yaw_rate[rows]))
    turning = truth.yaw_accel[rows] + truth.contact_yaw_accel[rows]
    alpha = np.column_stack((truth.roll_accel[rows], truth.pitch_accel[rows], turning))
    arm = np.broadcast_to(lever_arm(car), omega.shape)
    force += cross(alpha, arm) + cross(omega, cross(omega, arm))
    return np.column_stack((force, omega, roll, pitch, truth.yaw[rows]))


def cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of rows (k, 3); for a few rows much faster than numpy's."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.column_stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def lever_arm(car: Car) -> Floats:
    """Return the IMU's place relative to the centre of gravity, body frame (3,) [m]."""
    shape = shape_of(car)
    return np.array(car.vector("imu.position_m")) - (shape.cog_to_rear_axle, 0.0, shape.cog_height)


def tilted(level: Floats, roll: Floats, pitch: Floats) -> Floats:
    """Return vectors (k, 3) of the level frame in the rolled and pitched body frame."""
    x, y, z = level.T
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    forward, up = cp * x - sp * z, sp * x + cp * z
    return np.column_stack((forward, cr * y + sr * up, cr * up - sr * y))


def fields(readings: Floats) -> dict[str, list[tuple[float, ...]]]:
    """Return force, rates and orientation as message fields."""
    names = ("accel_mps2", "gyro_radps", "orientation_rad")
    parts = (readings[:, first : first + 3].tolist() for first in (0, 3, 6))
    return {name: list(map(tuple, part)) for name, part in zip(names, parts, strict=True)}


SENSOR = Sensor(
    "imu",
    ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2",
     "gyro_x_radps", "gyro_y_radps", "gyro_z_radps", "roll_rad", "pitch_rad", "yaw_rad"),
    ("imu.position_m", "imu.rate_hz", "imu.accel_noise_m_s2", "imu.gyro_noise_rad_s"),
    device,
    measure,
    fields,
)  # fmt: skip
