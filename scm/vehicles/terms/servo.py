"""Steering servo: follows its target no faster than its rate.

    servo_angle += clip(steer_target - servo_angle, -step, step),  step = rate * servo_pace * dt

Holds: one speed; what load leaves of it is servo_pace.   Shows in: steering steps.
Source: AutoDRIVE paper, steering (rate limit).
"""

import math

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def servo(
    steer_target: float, servo_angle: float, servo_pace: float, rate: float, dt: float
) -> float:
    """Road-wheel angle that the servo holds at the substep's end, + left [rad]."""
    step = rate * servo_pace * dt
    moved = servo_angle + math.copysign(step, steer_target - servo_angle)
    return steer_target if abs(steer_target - servo_angle) <= step else moved


TERM = Term(
    servo,
    per=Per.BODY,
    sets="servo_angle",
    keeps=0.0,
    neutral={"rate": 1e6},
    shows_in=("steering_step",),
    params=(
        Param("rate", 0.42, "rad/s", "steering.rate_rad_s", (0.02, 1e6),
              "fastest road-wheel motion", LogNormal(1.0, 1.0)),
    ),
)  # fmt: skip
