"""Battery telemetry of a fleet's cars: voltage under load, and remaining charge.

    charge_drawn += I dt,  I = idle_current + motors * stall_current * max(0, u (u V / V_n - n))
    V = max(cells * CUT_OFF_V, V0(charge) - R I)

It does not affect the motors: a car whose motors depend on their battery lists `battery_charge`,
`battery_curve` and `battery_resistance`, which use the same equations and numbers.
Holds: u as commanded, before lag and dead-band.   Source: as of those effects.
"""

import math
from dataclasses import astuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import array_kernel
from scm.vehicles.lipo import loaded_voltage, pack_current, pack_voltage
from scm.vehicles.pack import CUT_OFF_V, pack_of


class Packs:
    """The packs of a fleet, one row per car.

    Attributes:
        volts: At the terminals, under load [V]; NaN: no pack, or the row was never used.
        charge: Remaining charge, 0 to 1; likewise NaN.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        pack = pack_of(fleet.car)
        self._numbers: tuple[float, ...] | None = None if pack is None else astuple(pack)
        self._drawn: Floats = np.zeros(fleet.capacity)
        self.volts: Floats = np.full(fleet.capacity, math.nan)
        self.charge: Floats = np.full(fleet.capacity, math.nan)
        self.drain(np.empty(0, np.int64), 0.0)  # compile before the first car

    def renew(self, row: int) -> None:
        """Give a row a new pack."""
        self._drawn[row] = 0.0
        self.drain(np.array([row]), 0.0)

    def drain(self, rows: Ints, duration: float) -> None:
        """Discharge some cars' packs over a time [s] at the present commands and speeds."""
        if self._numbers is not None:
            fleet = self._fleet
            _drain(
                rows, duration, fleet.throttle, fleet.wheel_speed, self._drawn, self.volts,
                self.charge, *self._numbers,
            )  # fmt: skip


@array_kernel
def _drain(
    rows: Ints, duration: float, throttle: Floats, wheel_speed: Floats, drawn: Floats,
    volts: Floats, charge: Floats, cells: float, capacity: float, start: float, resistance: float,
    full: float, idle: float, nominal: float, no_load: float, front: float, rear: float,
) -> None:  # fmt: skip
    most = start * capacity * 3600.0
    for row in rows:
        u, w = throttle[row], wheel_speed[row]
        wheels = front * (w[0] + w[1]) + rear * (w[2] + w[3])
        turn = wheels / (max(1.0, 2.0 * (front + rear)) * no_load)
        rest = pack_voltage(drawn[row], cells, capacity, start)
        loaded = loaded_voltage(rest, resistance, u, turn, full, idle, nominal)
        used = duration * pack_current(loaded, u, turn, full, idle, nominal)
        drawn[row] = min(most, drawn[row] + used)
        rest = pack_voltage(drawn[row], cells, capacity, start)
        loaded = loaded_voltage(rest, resistance, u, turn, full, idle, nominal)
        volts[row] = max(cells * CUT_OFF_V, loaded)
        charge[row] = max(0.0, start - drawn[row] / (3600.0 * capacity))
