"""Measurements of a car's own sensors: encoders, inertial ones, feedback, indoor position."""

from typing import ClassVar

from scm.v2x.message import Message


class VehicleSensors(Message, kw_only=True, frozen=True):
    """Cumulative encoder counts of the rear wheels, and the newest of each other sensor.

    A sensor that the car has not, or that has not read yet, is None.

    Attributes:
        t_ns: The instant of the encoders' reading.
        encoder_left: Counts since the car was placed, + = forward.
        accel_mps2: x forward, y left, z up, gravity included, at the IMU.
        gyro_radps: Roll, pitch and yaw rate.
        orientation_rad: Roll, pitch and yaw by the IMU.
        throttle: The last command to the motor controller, -1 to 1.
        steering_rad: Mean angle of the front wheels, + = left.
        ips_m: Where the tag on the roof is, map frame; `ips_yaw_rad` which way it looks.
    """

    KEY: ClassVar[str] = "v/{vehicle}/sensors"
    RATE_HZ: ClassVar[float | None] = 50.0

    vehicle: str
    t_ns: int
    encoder_left: int
    encoder_right: int
    accel_mps2: tuple[float, float, float]
    gyro_radps: tuple[float, float, float]
    orientation_rad: tuple[float, float, float] | None = None
    throttle: float | None = None
    steering_rad: float | None = None
    ips_m: tuple[float, float] | None = None
    ips_yaw_rad: float | None = None


MESSAGE = VehicleSensors
