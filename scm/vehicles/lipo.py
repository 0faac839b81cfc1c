"""A lithium-polymer pack: its voltage over its charge, and the current of the motors.

Piecewise linear between the points of the usual 1C rest chart (3.27 V empty, 3.69 V at a tenth,
3.84 V at half, 4.20 V full); cells differ by some 20 mV from it.
"""

import numpy as np

from scm.vehicles.jit import kernel_function, plain

_BENDS = (0.0, 0.05, 0.1, 0.3, 0.5, 0.8, 1.0)


@kernel_function
def cell_voltage(charge: float) -> float:
    """Voltage of one cell at rest by its state of charge 0..1 [V]."""
    steep = 6.8 * min(max(charge, 0.0), 0.05) + 1.6 * min(max(charge - 0.05, 0.0), 0.05)
    flat = 0.4 * min(max(charge - 0.1, 0.0), 0.2) + 0.35 * min(max(charge - 0.3, 0.0), 0.2)
    full = 0.6 * min(max(charge - 0.5, 0.0), 0.3) + 0.9 * min(max(charge - 0.8, 0.0), 0.2)
    return 3.27 + (steep + flat + full)


@kernel_function
def pack_voltage(drawn: float, cells: float, capacity: float, start_charge: float) -> float:
    """Voltage of a pack without load, after `drawn` ampere-seconds of `capacity` ampere-hours."""
    return cells * cell_voltage(start_charge - drawn * (1.0 / (3600.0 * capacity)))


@kernel_function
def loaded_voltage(
    open_circuit: float, resistance: float, throttle: float, turn: float,
    motor_current: float, idle_current: float, nominal: float,
) -> float:  # fmt: skip
    """Voltage at the pack's terminals while choppers drive its motors [V].

    A chopper draws `throttle` times the motor's current; that current falls with `turn`, the speed
    over the no-load speed, and rises with the voltage itself: solved in closed form. Braking motors
    do not recharge. `motor_current` is of all motors at stall and nominal voltage [A].
    """
    idle = open_circuit - resistance * idle_current
    pull = resistance * motor_current * throttle
    return max(0.0, min(idle, (idle + pull * turn) / (1.0 + pull * throttle * (1.0 / nominal))))


@kernel_function
def pack_current(
    voltage: float, throttle: float, turn: float, motor_current: float, idle_current: float,
    nominal: float,
) -> float:  # fmt: skip
    """Current out of the pack, never negative [A]; arguments as of `loaded_voltage`."""
    share = throttle * (throttle * voltage * (1.0 / nominal) - turn)
    return idle_current + motor_current * max(0.0, share)


def charge_of(volts: float) -> float:
    """Return the state of charge, 0 to 1, of a cell by its voltage at rest [V]."""
    return float(np.interp(volts, [plain(cell_voltage)(bend) for bend in _BENDS], _BENDS))
