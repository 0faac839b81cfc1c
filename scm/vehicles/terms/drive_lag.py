"""Throttle lag: the motor's force follows the command through a first-order lag.

    throttle += (throttle_scaled - throttle) * dt / (time_constant + dt)

Holds: one dominant time constant.   Shows in: throttle steps.
Source: Lorenzo-Lyons/DART, vehicle model (throttle time constant).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_lag(throttle_scaled: float, throttle: float, time_constant: float, dt: float) -> float:
    """Throttle at the substep's end, + forward; exactly the command without lag."""
    share = dt / (time_constant + dt)
    return share * throttle_scaled + (1.0 - share) * throttle


TERM = Term(
    drive_lag,
    per=Per.BODY,
    sets="throttle",
    keeps=0.0,
    neutral={"time_constant": 0.0},
    shows_in=("throttle_step",),
    params=(
        Param("time_constant", 0.0, "s", "drive.lag_s", (0.0, 2.0),
              "63 % of a step", LogNormal(0.05, 0.8), report="time_constant_s"),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.02,), (0.04,), (0.08,), (0.16,)),
        steps=(0.01,),
        sentence="The motor follows the throttle sluggishly, with a time constant of "
                 "{time_constant_s}.",
        advice="Look for a soft start or a filter in the motor controller. Switch it off, or keep"
               " the lag in the simulator.",
        varies=True,
    ),
)  # fmt: skip
