"""Steering rate: the servo is faster or slower than its data sheet.

    servo_pace = scale * servo_load_pace

Holds: servos that run at one speed.   Shows in: steering steps, fast slaloms.
Source: servo data sheets give the speed at one voltage; it goes with the supply.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def steer_rate(servo_load_pace: float, scale: float) -> float:
    """Servo speed over the nominal one."""
    return scale * servo_load_pace


TERM = Term(
    steer_rate,
    per=Per.BODY,
    sets="servo_pace",
    neutral={"scale": 1.0},
    shows_in=("steering_step", "slalom"),
    params=(
        Param("scale", 1.0, "1", "steering.rate_scale", (0.05, 5.0),
              "speed over the nominal one", LogNormal(1.0, 0.4)),
    ),
)  # fmt: skip
