"""Steering servo: follows its target no faster than its rate.

    steer_angle += clip(steer_target - steer_angle, -rate * dt, rate * dt)    [rad]

Holds: servo that is strong against the tyres.   Shows in: steering steps.
Source: AutoDRIVE paper, steering (rate limit).
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def servo(steer_target: float, steer_angle: float, rate: float, dt: float) -> float:
    """Mean road-wheel angle at the substep's end, + left [rad]."""
    step = rate * dt
    if abs(steer_target - steer_angle) <= step:
        return steer_target
    return steer_angle + step if steer_target > steer_angle else steer_angle - step


TERM = Term(
    servo,
    per=Per.BODY,
    sets="steer_angle",
    keeps=0.0,
    neutral={"rate": 1e6},
    shows_in=("steering_step",),
    params=(
        Param("rate", 0.42, "rad/s", "steering.rate_rad_s", (0.02, 1e6),
              "fastest road-wheel motion", LogNormal(1.0, 1.0)),
    ),
)  # fmt: skip
