"""Encoder counts and inertial measurements of a car, as its own sensors give them."""

from typing import ClassVar

from scm.v2x.message import Message


class VehicleSensors(Message, kw_only=True, frozen=True):
    """Cumulative encoder counts of the rear wheels and one IMU sample in the body frame.

    Attributes:
        encoder_left: Counts since the car was placed, + = forward.
        accel_mps2: x forward, y left, z up, gravity included, at the IMU.
        gyro_radps: Roll, pitch and yaw rate.
    """

    KEY: ClassVar[str] = "v/{vehicle}/sensors"
    RATE_HZ: ClassVar[float | None] = 50.0

    vehicle: str
    t_ns: int
    encoder_left: int
    encoder_right: int
    accel_mps2: tuple[float, float, float]
    gyro_radps: tuple[float, float, float]


MESSAGE = VehicleSensors
