"""A car's battery pack, from its file and the effects' defaults.

Holds: one pack that feeds motors behind choppers and everything else.
Source: as of the effects `battery_charge`, `battery_curve` and `battery_resistance`, whose numbers
these are; `CUT_OFF_V` is where speed controllers of hobby cars switch off, to spare the cells.
"""

from dataclasses import dataclass

from scm.vehicles.car import Car, all_terms
from scm.vehicles.jit import plain
from scm.vehicles.lipo import charge_of, pack_current

CUT_OFF_V = 3.0
"""Of one cell, under load."""


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
