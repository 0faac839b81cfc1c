"""Servo torque: side force on the front wheels slows the servo, down to a stop.

    servo_load_pace = max(0, 1 - |trail * F_front| / stall)
    F_front = (mass * accel_y * cog_to_rear_axle + yaw_inertia * yaw_accel) / wheelbase    [N]

Holds: speed falls in a line with torque; the load is the side force, scrub at rest left out.
Shows in: fast slaloms.   Source: DC servo line; front force from Newton and Euler in the plane.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def servo_torque(
    accel_y: float, yaw_accel: float, mass: float, cog_to_rear_axle: float, yaw_inertia: float,
    wheelbase: float, trail: float, stall: float,
) -> float:  # fmt: skip
    """Servo speed that the load leaves, over its free speed."""
    front = mass * accel_y * cog_to_rear_axle + yaw_inertia * yaw_accel
    return max(0.0, 1.0 - abs(front) * (trail / (wheelbase * stall)))


TERM = Term(
    servo_torque,
    per=Per.BODY,
    sets="servo_load_pace",
    neutral={"trail": 0.0},
    shows_in=("slalom",),
    params=(
        Param("trail", 0.008, "m", "steering.trail_m", (0.0, 0.05),
              "side force's lever about the king pin", LogNormal(0.008, 0.5)),
        Param("stall", 0.25, "N*m", "steering.stall_torque_nm", (0.005, 10.0),
              "of the servo, at the king pins", LogNormal(0.25, 0.5)),
    ),
)  # fmt: skip
