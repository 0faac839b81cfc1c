"""Battery charge: counts what motors and electronics take out of the pack.

    charge_drawn += (idle_current + motors * stall_current * max(0, u (u V / V_n - n))) * dt  [A*s]

u is the throttle, n the driven wheels' speed over no-load speed, V the loaded voltage at charge.
Holds: choppers that give nothing back when braking; a stall_current of at least what gives the
motor's power, stall torque times no-load speed over nominal voltage.   Shows in: long drives.
Source: DC motor behind a chopper (Fitzgerald, Electric Machinery); state of charge by counting.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lipo import loaded_voltage, pack_current, pack_voltage
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def battery_charge(
    charge_drawn: float, throttle: float, drive_omega: float, front_driven: float,
    rear_driven: float, no_load_speed: float, battery_nominal: float, cells: float,
    capacity: float, start_charge: float, resistance: float, stall_current: float,
    idle_current: float, dt: float,
) -> float:  # fmt: skip
    """Charge taken since the start [A*s]."""
    full, turn = (
        2.0 * (front_driven + rear_driven) * stall_current,
        drive_omega * (1.0 / no_load_speed),
    )
    rest = pack_voltage(charge_drawn, cells, capacity, start_charge)
    volts = loaded_voltage(rest, resistance, throttle, turn, full, idle_current, battery_nominal)
    return charge_drawn + dt * pack_current(
        volts, throttle, turn, full, idle_current, battery_nominal
    )  # fmt: skip


TERM = Term(
    battery_charge,
    per=Per.BODY,
    sets="charge_drawn",
    keeps=0.0,
    neutral={"stall_current": 0.0, "idle_current": 0.0},
    shows_in=("long_drive",),
    params=(
        Param("no_load_speed", 9.1807, "rad/s", "drive.no_load_speed_rad_s", (0.5, 1000.0),
              "of the wheel, full throttle", LogNormal(9.18, 0.2)),
        Param("battery_nominal", 11.1, "V", "drive.battery_nominal_v", (1.0, 60.0),
              "voltage at which the torque is given", fit=False),
        Param("cells", 3.0, "1", "battery.cells", (1.0, 20.0), "in series", fit=False),
        Param("capacity", 5.2, "A*h", "drive.battery_capacity_ah", (0.01, 500.0),
              "from full to empty", LogNormal(5.2, 0.2)),
        Param("start_charge", 1.0, "1", "battery.start_charge", (0.0, 1.0), "1 is full"),
        Param("resistance", 0.03, "ohm", "battery.resistance_ohm", (0.0, 2.0),
              "of the pack and its leads", LogNormal(0.03, 0.7)),
        Param("stall_current", 1.5, "A", "battery.stall_current_a", (0.0, 300.0),
              "of one driven wheel's motor", LogNormal(1.5, 0.5)),
        Param("idle_current", 0.8, "A", "battery.idle_current_a", (0.0, 50.0),
              "of everything but the motors", LogNormal(0.8, 0.5)),
    ),
)  # fmt: skip
