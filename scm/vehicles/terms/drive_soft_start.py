"""Soft start: the throttle rises slowly and falls at once.

    where |throttle_live| > |throttle_eased|:
        throttle_eased += (throttle_live - throttle_eased) * dt / (time_constant + dt)
    else throttle_eased = throttle_live

Holds: one time constant, the same both ways.   Shows in: throttle steps, up and down.
Source: speed controllers for model cars have a soft start or punch; the first-order form is ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_soft_start(
    throttle_live: float, throttle_eased: float, time_constant: float, dt: float
) -> float:
    """Throttle at the substep's end, + forward; exactly the command without a soft start."""
    rising = time_constant if abs(throttle_live) > abs(throttle_eased) else 0.0
    share = dt / (rising + dt)
    return share * throttle_live + (1.0 - share) * throttle_eased


TERM = Term(
    drive_soft_start,
    per=Per.BODY,
    sets="throttle_eased",
    keeps=0.0,
    neutral={"time_constant": 0.0},
    shows_in=("throttle_step",),
    params=(
        Param("time_constant", 0.0, "s", "drive.soft_start_s", (0.0, 5.0),
              "63 % of a step up", LogNormal(0.2, 0.8), report="time_constant_s"),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.04,), (0.15,), (0.5,)),
        steps=(0.01,), rare=4.0,
        sentence="The motor follows a throttle that rises sluggishly, with a time constant of "
                 "{time_constant_s}, and one that falls at once.",
        advice="Look for a soft start or punch setting of the motor controller. Switch it off, or "
               "keep it in the simulator.",
    ),
)  # fmt: skip
