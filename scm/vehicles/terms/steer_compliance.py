"""Steering compliance: the front wheels give way under side force.

    steer_angle += (steer_trimmed - c * F_front / (mass * g) - steer_angle) * dt / (tau + dt)
    F_front = (mass * accel_y * cog_to_rear_axle + yaw_inertia * yaw_accel) / wheelbase    [N]

c is `rad_per_weight`. A soft rod is damped too: tau = 0.04 s for each radian per weight.
Holds: side force alone, from Newton and Euler in the plane.   Shows in: circles at two speeds.
Source: Milliken, Race Car Vehicle Dynamics (1995), chapter 23: lateral force compliance steer.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def steer_compliance(
    steer_trimmed: float, steer_angle: float, accel_y: float, yaw_accel: float, mass: float,
    cog_to_rear_axle: float, yaw_inertia: float, wheelbase: float, rad_per_weight: float, dt: float,
) -> float:  # fmt: skip
    """Mean road-wheel angle at the substep's end, + left [rad]."""
    force = accel_y * cog_to_rear_axle + yaw_inertia / mass * yaw_accel
    give = force * (rad_per_weight / (wheelbase * 9.80665))
    share = dt / (0.04 * rad_per_weight + dt)
    return share * (steer_trimmed - give) + (1.0 - share) * steer_angle


TERM = Term(
    steer_compliance,
    per=Per.BODY,
    sets="steer_angle",
    keeps=0.0,
    neutral={"rad_per_weight": 0.0},
    shows_in=("fast_circle", "two_speed_circle"),
    params=(
        Param("rad_per_weight", 0.0, "rad", "steering.compliance_rad", (0.0, 1.0),
              "angle given way where the front's side force is the car's weight",
              LogNormal(0.05, 1.0)),
    ),
)  # fmt: skip
