"""What contacts do to accelerometers: the mean acceleration that they add over a tick.

A hit is an impulse of no duration; a device that reads once a tick feels it as that tick's mean.
"""

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.fleet import Fleet


class Impacts:
    """Adds up the tick's contacts in the fleets' `contact_accel_x` and its siblings."""

    def __init__(self) -> None:
        self._struck: list[tuple[Fleet, Ints]] = []
        self._share = 0.0

    def begin(self, duration: float) -> None:
        """Forget the last tick's; the tick that begins lasts `duration` [s]."""
        for fleet, rows in self._struck:
            fleet.contact_accel_x[rows] = fleet.contact_accel_y[rows] = fleet.contact_yaw_accel[
                rows
            ] = 0.0
        self._struck.clear()
        self._share = 1.0 / duration if duration > 0.0 else 0.0

    def add(self, fleet: Fleet, rows: Ints, dv: Floats) -> None:
        """Note changes of velocity x, y and yaw rate (k, 3), map frame, of different rows."""
        yaw = fleet.yaw[rows]
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, turn = self._share * dv.T
        fleet.contact_accel_x[rows] += c * x + s * y
        fleet.contact_accel_y[rows] += c * y - s * x
        fleet.contact_yaw_accel[rows] += turn
        self._struck.append((fleet, rows))
