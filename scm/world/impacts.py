"""What contacts do to accelerometers: the mean acceleration that they add over a tick.

A hit is an impulse of no duration; a device that reads once a tick feels it as that tick's mean.
"""

import math

import numpy as np

from scm.arrays import Floats
from scm.vehicles.fleet import Fleet


class Impacts:
    """Adds up the tick's contacts in `impact_x`, `impact_y` and `impact_yaw` of the fleets."""

    def __init__(self) -> None:
        self._struck: set[tuple[int, int]] = set()
        self._fleets: dict[int, Fleet] = {}
        self._share = 0.0

    def begin(self, duration: float) -> None:
        """Forget the last tick's; the tick that begins lasts `duration` [s]."""
        for key, row in self._struck:
            fleet = self._fleets[key]
            fleet.impact_x[row] = fleet.impact_y[row] = fleet.impact_yaw[row] = 0.0
        self._struck.clear()
        self._share = 1.0 / duration if duration > 0.0 else 0.0

    def add(self, fleet: Fleet, row: int, dv: Floats) -> None:
        """Note a change of velocity x, y and yaw rate, map frame."""
        yaw = float(fleet.yaw[row])
        c, s = math.cos(yaw), math.sin(yaw)
        x, y, turn = (self._share * np.asarray(dv)).tolist()
        fleet.impact_x[row] += c * x + s * y
        fleet.impact_y[row] += c * y - s * x
        fleet.impact_yaw[row] += turn
        self._fleets[id(fleet)] = fleet
        self._struck.add((id(fleet), row))
