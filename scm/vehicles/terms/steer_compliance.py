"""Steering compliance: the front wheels give way under side force.

    steer_angle = steer_trimmed - steer_yielded    [rad]
    DAMPED * d(steer_yielded)/dt = c * F_front / (mass * g) - steer_yielded
    F_front = (mass * accel_y * cog_to_rear_axle + yaw_inertia * yaw_accel) / wheelbase    [N]

c is `rad_per_weight`, DAMPED = 1 ms: a spring and a damper side by side; the servo's motion goes
through. A substep is implicit in the force that the front wheels lose or gain by turning, 8 weights
a radian; as they are steered only |vx| / (|vx| + 2 m/s) of it: the slower a car, the sooner its
turning takes that force back.
Holds: side force alone, from Newton and Euler in the plane.   Shows in: circles at two speeds.
Source: Milliken, Race Car Vehicle Dynamics (1995), chapter 23: lateral force compliance steer.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_DAMPED = 0.001  # s, of the rod alone; ours
_FRONT = 8.0  # weights a radian; cars have 3 to 10, and twice as much does not chatter yet
_SLOW = 2.0  # m/s; ours, it brings substeps of 1 ms nearest to those of 0.25 ms


@kernel_function
def steer_compliance(
    steer_trimmed: float, steer_before: float, steer_yielded: float, accel_y: float,
    yaw_accel: float, vx: float, mass: float, cog_to_rear_axle: float, yaw_inertia: float,
    wheelbase: float, rad_per_weight: float, dt: float,
) -> float:  # fmt: skip
    """Angle that the wheels have given way at the substep's end, + right [rad]."""
    force = accel_y * cog_to_rear_axle + yaw_inertia / mass * yaw_accel
    give = force * (rad_per_weight / (wheelbase * 9.80665))
    more = _FRONT * rad_per_weight
    turned = abs(vx) / (abs(vx) + _SLOW) * (steer_trimmed - steer_before - steer_yielded)
    share = dt / (_DAMPED + dt * (1.0 + more))
    return steer_yielded + share * (give + more * turned - steer_yielded)


@kernel_function
def steer_compliance_angle(steer_trimmed: float, steer_yielded: float) -> float:
    """Mean road-wheel angle, + left [rad]."""
    return steer_trimmed - steer_yielded


TERM = Term(
    steer_compliance,
    per=Per.BODY,
    sets="steer_yielded",
    keeps=0.0,
    neutral={"rad_per_weight": 0.0},
    shows_in=("fast_circle", "two_speed_circle"),
    params=(
        Param("rad_per_weight", 0.0, "rad", "steering.compliance_rad", (0.0, 1.0),
              "angle given way where the front's side force is the car's weight",
              LogNormal(0.05, 1.0)),
    ),
    also=(Term(steer_compliance_angle, per=Per.BODY, sets="steer_angle",
               shows_in=("fast_circle",)),),
    identification=Identification(
        equation="steering", depends_on=("lateral force",), starts=((0.03,), (0.1,), (0.3,)),
        steps=(0.01,), needs_m_s2=0.5,
        sentence="The front wheels give way under side force, {rad_per_weight} for the car's "
                 "weight.",
        advice="Press a front wheel sideways with the servo powered: look for a soft servo saver "
               "or a bending link.",
        varies=True,
    ),
)  # fmt: skip
