"""Battery resistance: the voltage gives way under the motors' current, at once.

    terminal_voltage = V0 - resistance * (idle_current + motors * stall_current * u (u V / V_n - n))

V = terminal_voltage on both sides, solved in closed form; V0 without load, u the throttle, n the
driven wheels' speed over no-load speed.
Holds: one ohmic resistance, choppers that give nothing back.   Shows in: hard launches.
Source: Thevenin's equivalent of a cell (Plett, Battery Management Systems, volume 1).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lipo import loaded_voltage
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def battery_resistance(
    open_circuit_voltage: float, throttle: float, drive_omega: float, front_driven: float,
    rear_driven: float, no_load_speed: float, battery_nominal: float, resistance: float,
    stall_current: float, idle_current: float,
) -> float:  # fmt: skip
    """Voltage at the clamps [V]."""
    full, turn = (
        2.0 * (front_driven + rear_driven) * stall_current,
        drive_omega * (1.0 / no_load_speed),
    )
    return loaded_voltage(
        open_circuit_voltage, resistance, throttle, turn, full, idle_current, battery_nominal
    )  # fmt: skip


TERM = Term(
    battery_resistance,
    per=Per.BODY,
    sets="terminal_voltage",
    neutral={"resistance": 0.0},
    shows_in=("hard_launch",),
    params=(
        Param("no_load_speed", 9.1807, "rad/s", "drive.no_load_speed_rad_s", (0.5, 1000.0),
              "of the wheel, full throttle", LogNormal(9.18, 0.2)),
        Param("battery_nominal", 11.1, "V", "drive.battery_nominal_v", (1.0, 60.0),
              "voltage at which the torque is given", fit=False),
        Param("resistance", 0.03, "ohm", "battery.resistance_ohm", (0.0, 2.0),
              "of the pack and its leads", LogNormal(0.03, 0.7)),
        Param("stall_current", 1.5, "A", "battery.stall_current_a", (0.0, 300.0),
              "of one driven wheel's motor", LogNormal(1.5, 0.5)),
        Param("idle_current", 0.8, "A", "battery.idle_current_a", (0.0, 50.0),
              "of everything but the motors", LogNormal(0.8, 0.5)),
    ),
)  # fmt: skip
