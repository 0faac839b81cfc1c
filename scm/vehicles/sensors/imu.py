"""IMU: specific force and turn rate at its place on the body, in the tilted body frame.

    f = R^T (a_cog + g z) + alpha x r + omega x (omega x r)          x forward, y left, z up
    gyro = omega                                                     roll, pitch, yaw rate

r reaches from the centre of gravity to the IMU, R tilts the level frame by pitch, then roll.
Holds: rigid mounting, small roll and pitch.
Source: rigid-body kinematics; noise of the MPU-9250's class, from the car file.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import Car
from scm.vehicles.sensor import Around, Facts, Sensor, Truth


def facts(car: Car) -> Facts:
    """Return the device of a car file."""
    accel = car.value("imu.accel_noise_m_s2")
    gyro = car.value("imu.gyro_noise_rad_s")
    return Facts(rate_hz=car.value("imu.rate_hz"), noise=(accel,) * 3 + (gyro,) * 3)


def measure(car: Car, truth: Truth, rows: Ints, around: Around | None) -> Floats:
    """Return specific force [m/s^2] and turn rate [rad/s], (k, 6)."""
    level = np.column_stack(
        (truth.accel_x[rows], truth.accel_y[rows], truth.accel_z[rows] + GRAVITY)
    )
    force = tilted(level, truth.roll[rows], truth.pitch[rows])
    omega = np.column_stack((truth.roll_rate[rows], truth.pitch_rate[rows], truth.yaw_rate[rows]))
    alpha = np.column_stack(
        (truth.roll_accel[rows], truth.pitch_accel[rows], truth.yaw_accel[rows])
    )
    arm = np.broadcast_to(lever_arm(car), omega.shape)
    force += cross(alpha, arm) + cross(omega, cross(omega, arm))
    return np.column_stack((force, omega))


def cross(a: Floats, b: Floats) -> Floats:
    """Return the vector products of rows (k, 3); for a few rows much quicker than numpy's own."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.column_stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def lever_arm(car: Car) -> Floats:
    """Return the IMU's place as seen from the centre of gravity, body frame (3,) [m]."""
    cog = (car.value("body.cog_to_rear_axle_m"), 0.0, car.value("body.cog_height_m"))
    return np.array(car.vector("imu.position_m")) - cog


def tilted(level: Floats, roll: Floats, pitch: Floats) -> Floats:
    """Return vectors (k, 3) of the level frame as seen from the body, rolled and pitched."""
    x, y, z = level.T
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    forward, up = cp * x - sp * z, sp * x + cp * z
    return np.column_stack((forward, cr * y + sr * up, cr * up - sr * y))


SENSOR = Sensor(
    "imu",
    ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2",
     "gyro_x_radps", "gyro_y_radps", "gyro_z_radps"),
    ("imu.position_m", "imu.rate_hz", "imu.accel_noise_m_s2", "imu.gyro_noise_rad_s"),
    facts,
    measure,
)  # fmt: skip
