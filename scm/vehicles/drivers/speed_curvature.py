"""Throttle and steering for a speed and a curvature that a trained policy chooses.

The throttle is that of `speed_control`; backward, that of the mirrored car. The steering is that of
`steering`: atan(wheelbase * curvature) over the largest angle.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.driver_state import INTEGRAL, SPEED_SETPOINT, STEER_LIMIT, kind_row
from scm.vehicles.drivers.speed_control import throttle
from scm.vehicles.drivers.steering import wheel_angle
from scm.vehicles.jit import array_kernel

COLUMNS = 8  # of a driver's state


class SpeedCurvatureController:
    """Follows speeds and curvatures with some cars of one kind.

    Args:
        limits: Of the cars.
        count: How many.
    """

    def __init__(self, limits: CarLimits, count: int) -> None:
        self._kind = kind_row(limits, 0.0)
        self._floats: Floats = np.zeros((count, COLUMNS))
        self._gears: Floats = np.ones(count)

    def begin(self, rows: Ints, speed: Floats) -> None:
        """Begin anew for cars (n,) that drive at these speeds, (n,) [m/s]."""
        self._floats[rows] = 0.0
        self._gears[rows] = np.where(speed < 0.0, -1.0, 1.0)
        self._floats[rows, SPEED_SETPOINT] = np.abs(speed)

    def commands(self, chosen: Floats, speed: Floats, passed_s: float) -> Floats:
        """Return throttle and steering of all cars, (count, 2), -1 to 1: + forward, + left.

        Args:
            chosen: Speed [m/s], + = forward, and curvature [1/m], + = the wheels turn left,
                (count, 2).
            speed: Of the cars now, (count,) [m/s].
            passed_s: Since the commands before.
        """
        found: Floats = np.empty((len(speed), 2))
        _command(self._kind, self._floats, self._gears, chosen, speed, passed_s, found)
        return found


@array_kernel
def _command(
    kind: Floats, floats: Floats, gears: Floats, chosen: Floats, speed: Floats, passed: float,
    found: Floats,
) -> None:  # fmt: skip
    for row in range(len(speed)):
        gear = -1.0 if chosen[row, 0] < 0.0 else 1.0
        if gear != gears[row]:
            floats[row, SPEED_SETPOINT] = floats[row, INTEGRAL] = 0.0
            gears[row] = gear
        target = gear * chosen[row, 0]
        found[row, 0] = gear * throttle(kind, floats[row], target, gear * speed[row], passed)
        found[row, 1] = wheel_angle(kind, chosen[row, 1]) / kind[STEER_LIMIT]
