"""Steering rate: the servo is faster or slower than its data sheet.

    servo_pace = scale * servo_load_pace

Holds: servos that run at one speed.   Shows in: steering steps, fast slaloms.
Source: servo data sheets give the speed at one voltage; it goes with the supply.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
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
    identification=Identification(
        equation="steering", depends_on=("steering",), starts=((0.5,), (0.75,), (1.5,)),
        steps=(0.05,),
        sentence="The steering servo turns at {scale} of its nominal rate.",
        advice="Time the servo from stop to stop under load; check its voltage.",
        own="steering.rate_rad_s",
        varies=True,
    ),
)  # fmt: skip
