"""Steering delay: the servo hears a command some time after it was given.

    steering_received = steering_command(t - delay)

Holds: constant dead time; the skeleton keeps the commands.   Shows in: steering steps.
Source: textbook dead time; radio, bus and the servo's 20 ms frame together.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_delay(steering_past: float) -> float:
    """Steering command that arrives now, + left."""
    return steering_past


TERM = Term(
    steer_delay,
    per=Per.BODY,
    sets="steering_received",
    neutral={"delay": 0.0},
    shows_in=("steering_step",),
    params=(
        Param("delay", 0.0, "s", "steering.delay_s", (0.0, 0.5),
              "from command to servo", LogNormal(0.05, 0.8), report="delay_s"),
    ),
    identification=Identification(
        equation="steering", depends_on=("steering",), starts=((0.02,), (0.04,), (0.08,), (0.16,)),
        steps=(0.01,),
        sentence="The steering answers {delay_s} late.",
        advice="Look at the way from command to servo: radio, controller, filters. Keep the delay"
               " in the simulator if it belongs there.",
    ),
)  # fmt: skip
