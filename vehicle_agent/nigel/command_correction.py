"""Corrects commands for a calibrated car, so that its wheels do what was requested.

    throttle_sent = throttle / gain + sign(throttle) * deadband      zero stays zero: it brakes
    steering_sent = (steering - trim / limit) / gain

This inverts the effects `drive_deadband`, `drive_gain`, `steer_gain` and `steer_trim`, with the
parameters of the calibrated car file. Valid while no actuator is at its limit.
"""

import math
from dataclasses import dataclass

from scm.vehicles.car import Car

DEADBAND, DRIVE_GAIN = "drive.deadband", "drive.gain"
TRIM, STEER_GAIN = "steering.trim_rad", "steering.gain"


@dataclass(frozen=True, slots=True)
class CommandCorrection:
    """One car's correction parameters.

    Attributes:
        deadband: Throttle below which the motor does not turn.
        drive_gain: Effective throttle over throttle sent beyond the dead-band.
        trim: Of the wheels at zero steering, as a share of the full angle, + = left.
        steer_gain: Actual angle over nominal angle.
    """

    deadband: float = 0.0
    drive_gain: float = 1.0
    trim: float = 0.0
    steer_gain: float = 1.0

    def throttle(self, desired: float) -> float:
        """Return the throttle to send for a desired one beyond the dead-band."""
        if desired == 0.0:
            return 0.0
        return desired / self.drive_gain + math.copysign(self.deadband, desired)

    def steering(self, desired: float) -> float:
        """Return the steering to send."""
        return (desired - self.trim) / self.steer_gain


def correction_of(car: Car, limit: float) -> CommandCorrection:
    """Return the correction from a car file; defaults where it has no value.

    `limit` is the full steering angle [rad].
    """

    def known(key: str, default: float) -> float:
        return car.value(key) if car.has(key) else default

    return CommandCorrection(
        deadband=known(DEADBAND, 0.0),
        drive_gain=known(DRIVE_GAIN, 1.0),
        trim=known(TRIM, 0.0) / limit,
        steer_gain=known(STEER_GAIN, 1.0),
    )
