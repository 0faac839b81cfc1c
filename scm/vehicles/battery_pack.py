"""Battery packs of a fleet's cars: voltage under load, and remaining charge.

    charge_drawn += I dt,  I = idle_current + motors * stall_current * max(0, u (u V / V_n - n))
    V = max(cells * CUT_OFF_V, V0(charge) - R I)

It does not affect the motors: a car whose motors depend on their battery lists `battery_charge`,
`battery_curve` and `battery_resistance`, which use the same equations and numbers.
Holds: one pack that feeds motors behind choppers and everything else; u as commanded, before lag
and dead-band.   Source: as of those effects.
"""

import math
from dataclasses import astuple, dataclass

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car, all_terms
from scm.vehicles.fleet import Fleet
from scm.vehicles.jit import array_kernel, plain
from scm.vehicles.lipo import charge_of, loaded_voltage, pack_current, pack_voltage

CUT_OFF_V = 3.0
"""Cell voltage under load at which hobby speed controllers switch off to protect the battery."""


@dataclass(frozen=True, slots=True)
class Pack:
    """One kind of car's pack and its consumers.

    Attributes:
        capacity: From full to empty [A*h].
        start_charge: Of a new car, 0 to 1.
        resistance: Of the pack and its leads [ohm].
        motor_current: Of all motors, at stall and nominal voltage [A].
        idle_current: Of everything but the motors [A].
        nominal: Nominal voltage of the motors' numbers [V].
        no_load_speed: Of a driven wheel [rad/s].
        front, rear: Whether these axles' wheels are driven, 0 or 1.
    """

    cells: float
    capacity: float
    start_charge: float
    resistance: float
    motor_current: float
    idle_current: float
    nominal: float
    no_load_speed: float
    front: float
    rear: float

    def charge_at(self, volts: float, throttle: float, wheel_speed: float) -> float:
        """Return the remaining charge by a voltage measured under load, 0 to 1.

        `wheel_speed` is that of the driven wheels [rad/s].
        """
        turn = wheel_speed / self.no_load_speed
        current = plain(pack_current)(
            volts, throttle, turn, self.motor_current, self.idle_current, self.nominal
        )
        return charge_of((volts + self.resistance * current) / self.cells)


def pack_of(car: Car) -> Pack | None:
    """Return a car's pack, or None if its file describes no battery-driven motors."""
    if not (car.has("drive.battery_nominal_v") and car.has("drive.no_load_speed_rad_s")):
        return None
    defaults = {param.key: param.default for param in all_terms()["battery_charge"].params}

    def number(key: str) -> float:
        return car.value(key) if car.has(key) else defaults[key]

    front, rear = car.value("drive.front_driven"), car.value("drive.rear_driven")
    return Pack(
        cells=number("battery.cells"),
        capacity=number("drive.battery_capacity_ah"),
        start_charge=number("battery.start_charge"),
        resistance=number("battery.resistance_ohm"),
        motor_current=2.0 * (front + rear) * number("battery.stall_current_a"),
        idle_current=number("battery.idle_current_a"),
        nominal=number("drive.battery_nominal_v"),
        no_load_speed=number("drive.no_load_speed_rad_s"),
        front=front,
        rear=rear,
    )


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

    def drawn_as(self, row: int) -> float:
        """Return the charge that a row's pack has given since it was new [A*s]."""
        return float(self._drawn[row])

    def put_drawn(self, row: int, drawn_as: float) -> None:
        """Set the charge that a row's pack has given [A*s]."""
        self._drawn[row] = drawn_as
        self.drain(np.array([row]), 0.0)

    def memory(self, row: int) -> tuple[Floats, ...]:
        """Return views of all that is stored of a row."""
        return tuple(values[row : row + 1] for values in (self._drawn, self.volts, self.charge))

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
