"""What a calibrated car must be told so that its wheels do what was wished.

    throttle_told = throttle / gain + sign(throttle) * deadband      zero stays zero: it brakes
    steering_told = (steering - trim / limit) / gain

The laws that this undoes are the effects `drive_deadband`, `drive_gain`, `steer_gain` and
`steer_trim`; the numbers are the car file's, of a calibration. Holds while nothing is at its stop.
"""

import math
from dataclasses import dataclass

from scm.vehicles.car import Car

DEADBAND, DRIVE_GAIN = "drive.deadband", "drive.gain"
TRIM, STEER_GAIN = "steering.trim_rad", "steering.gain"


@dataclass(frozen=True, slots=True)
class Undo:
    """One car's numbers.

    Attributes:
        deadband: Throttle below which nothing turns.
        drive_gain: Throttle that is live over throttle told beyond the dead-band.
        trim: Of the wheels at zero steering, as a share of the full angle, + = left.
        steer_gain: Angle over the angle meant.
    """

    deadband: float = 0.0
    drive_gain: float = 1.0
    trim: float = 0.0
    steer_gain: float = 1.0

    def throttle(self, wished: float) -> float:
        """Return the throttle to tell for one wished beyond the dead-band."""
        if wished == 0.0:
            return 0.0
        return wished / self.drive_gain + math.copysign(self.deadband, wished)

    def steering(self, wished: float) -> float:
        """Return the steering to tell."""
        return (wished - self.trim) / self.steer_gain


def undo_of(car: Car, limit: float) -> Undo:
    """Return what a car file says, where it says something; `limit` is the full angle [rad]."""

    def known(key: str, default: float) -> float:
        return car.value(key) if car.has(key) else default

    return Undo(
        deadband=known(DEADBAND, 0.0),
        drive_gain=known(DRIVE_GAIN, 1.0),
        trim=known(TRIM, 0.0) / limit,
        steer_gain=known(STEER_GAIN, 1.0),
    )
