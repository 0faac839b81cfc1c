"""Motor force curve with a dead-band: the car's whole drive force, split over its driven wheels.

    F = (a - b * vx) * w * (u + c),  w = (tanh(100 (u + c)) + 1) / 2,  u = throttle    [N]
    wheel_torque += driven * F * motor_strength * wheel_radius / driven wheels    [N*m]

Holds: forward throttle; a brushed motor that idles freely below its dead-band. No drive in reverse:
none of the 95 recordings published with it has a throttle below zero.
Shows in: throttle steps and ramps.   Source: Lorenzo-Lyons/DART, vehicle model (motor curve).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import tanh
from scm.vehicles.param import LogNormal, Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_curve(
    motor_throttle: float, fade_strength: float, motor_strength: float, vx: float, driven: float,
    front_driven: float, rear_driven: float, wheel_radius: float, force: float,
    force_per_speed: float, dead_band: float,
) -> float:  # fmt: skip
    """Torque on the wheel, + forward [N*m]."""
    beyond = motor_throttle * fade_strength + dead_band
    pull = (force - force_per_speed * vx) * 0.5 * (tanh(100.0 * beyond) + 1.0) * beyond
    share = driven / max(2.0 * (front_driven + rear_driven), 1.0)
    return share * pull * motor_strength * wheel_radius


TERM = Term(
    motor_curve,
    per=Per.WHEEL,
    adds="wheel_torque",
    neutral={"force": 0.0, "force_per_speed": 0.0},
    shows_in=("throttle_step", "throttle_ramp"),
    params=(
        Param("force", 25.36, "N", "drive.curve_force_n", (0.0, 500.0),
              "a: at rest, per throttle", LogNormal(25.0, 0.4)),
        Param("force_per_speed", 4.815, "N*s/m", "drive.curve_force_per_speed_ns_m", (0.0, 100.0),
              "b: lost per speed, per throttle", LogNormal(4.8, 0.4)),
        Param("dead_band", -0.1638, "1", "drive.curve_offset", (-0.6, 0.0),
              "c: minus the throttle that does nothing", Normal(-0.15, 0.05)),
    ),
)  # fmt: skip
