"""Throttle delay: the motor hears a command some time after it was given.

    throttle_received = throttle_command(t - delay)

Holds: constant dead time; the skeleton keeps the commands.   Shows in: throttle steps.
Source: textbook dead time; radio, bus and controller cycle together.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_delay(throttle_past: float) -> float:
    """Throttle that arrives now, + forward."""
    return throttle_past


TERM = Term(
    drive_delay,
    per=Per.BODY,
    sets="throttle_received",
    neutral={"delay": 0.0},
    shows_in=("throttle_step",),
    params=(
        Param("delay", 0.0, "s", "drive.delay_s", (0.0, 0.5),
              "from command to motor", LogNormal(0.05, 0.8), report="delay_s"),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.02,), (0.04,), (0.08,), (0.16,)),
        steps=(0.01,),
        sentence="The motor answers the throttle {delay_s} late.",
        advice="Look at the way from command to motor: radio, controller, filters. Keep the delay"
               " in the simulator if it belongs there.",
        own="clock.throttle_s",
    ),
)  # fmt: skip
