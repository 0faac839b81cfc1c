"""DC motors of a driven axle: torque falls with speed, and with the battery.

    wheel_torque += driven * stall_torque * motor_strength * (u - n / no_load_speed)
    u = motor_throttle * fade_strength * supply_voltage / battery_nominal
    n = axle_omega + axle_lock * (omega - axle_omega)

Both wheels of an axle get the torque of its mean speed, as behind a differential (axle_lock = 0).
Motors that each feel only their own wheel (axle_lock = 1) drag the axle straight: with Nigel's
numbers a circle at 0.1 m/s opens by 4 %.
Holds: brushed motors on a stiff supply, current settled within a millisecond.
Shows in: throttle steps, top speed.   Source: AutoDRIVE paper, actuators; values see the car file.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_dc(
    motor_throttle: float, fade_strength: float, supply_voltage: float, motor_strength: float,
    omega: float, axle_omega: float, driven: float, stall_torque: float, no_load_speed: float,
    battery_nominal: float, axle_lock: float,
) -> float:  # fmt: skip
    """Torque on the wheel, + forward [N*m]."""
    felt = axle_omega + axle_lock * (omega - axle_omega)
    u = motor_throttle * fade_strength * supply_voltage / battery_nominal
    return driven * stall_torque * motor_strength * (u - felt / no_load_speed)


@kernel_function
def motor_dc_damping(
    motor_strength: float, driven: float, stall_torque: float, no_load_speed: float,
    axle_lock: float,
) -> float:  # fmt: skip
    """Back EMF: torque lost per own wheel speed [N*m*s]."""
    return driven * stall_torque * motor_strength / no_load_speed * 0.5 * (1.0 + axle_lock)


TERM = Term(
    motor_dc,
    per=Per.WHEEL,
    adds="wheel_torque",
    damping=motor_dc_damping,
    neutral={"stall_torque": 0.0},
    shows_in=("throttle_step", "top_speed"),
    params=(
        Param("stall_torque", 0.3, "N*m", "drive.stall_torque_nm", (0.0, 20.0),
              "at the wheel, full throttle, at rest", LogNormal(0.3, 0.3)),
        Param("no_load_speed", 9.1807, "rad/s", "drive.no_load_speed_rad_s", (0.5, 1000.0),
              "of the wheel, full throttle", LogNormal(9.18, 0.2)),
        Param("battery_nominal", 11.1, "V", "drive.battery_nominal_v", (1.0, 60.0),
              "voltage at which the torque is given", fit=False),
        Param("axle_lock", 0.0, "1", "drive.axle_lock", (0.0, 1.0),
              "0 differential, 1 a motor of its own at each wheel"),
    ),
)  # fmt: skip
