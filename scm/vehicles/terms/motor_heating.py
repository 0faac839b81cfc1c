"""Motor heating: current warms a motor's winding, the air around takes the heat away.

    motor_heat += (stall_heat * load^2 - cooling * motor_heat) / thermal_mass * dt    [K]
    load = motor_throttle * fade_strength * supply_voltage / battery_nominal - n

n is the axle's speed over no_load_speed.
Holds: one thermal mass; |load| up to 1 is stall.   Shows in: long climbs, pushing a wall.
Source: lumped thermal model of a motor (Fitzgerald, Electric Machinery).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_heating(
    motor_heat: float, motor_throttle: float, fade_strength: float, supply_voltage: float,
    axle_omega: float, driven: float, no_load_speed: float, battery_nominal: float,
    stall_heat: float, cooling: float, thermal_mass: float, dt: float,
) -> float:  # fmt: skip
    """Temperature above the air, at the substep's end [K]."""
    voltage = motor_throttle * fade_strength * supply_voltage * (1.0 / battery_nominal)
    load = voltage - axle_omega * (1.0 / no_load_speed)
    gained = motor_heat + load * load * (dt * driven * stall_heat / thermal_mass)
    return gained * (1.0 / (1.0 + dt * cooling / thermal_mass))


TERM = Term(
    motor_heating,
    per=Per.WHEEL,
    sets="motor_heat",
    keeps=0.0,
    neutral={"stall_heat": 0.0},
    shows_in=("long_drive", "rest_and_repeat"),
    params=(
        Param("no_load_speed", 9.1807, "rad/s", "drive.no_load_speed_rad_s", (0.5, 1000.0),
              "of the wheel, full throttle", LogNormal(9.18, 0.2)),
        Param("battery_nominal", 11.1, "V", "drive.battery_nominal_v", (1.0, 60.0),
              "voltage at which the torque is given", fit=False),
        Param("stall_heat", 7.5, "W", "motor.stall_heat_w", (0.0, 5000.0),
              "lost in one motor at stall", LogNormal(7.5, 0.5)),
        Param("cooling", 0.08, "W/K", "motor.cooling_w_k", (1e-3, 50.0),
              "given to the air", LogNormal(0.08, 0.5)),
        Param("thermal_mass", 25.0, "J/K", "motor.thermal_mass_j_k", (0.1, 5000.0),
              "of one motor", LogNormal(25.0, 0.5)),
    ),
)  # fmt: skip
