"""Throttle saturation: a limit on either side cuts the throttle short.

    throttle_limited = clip(throttle_received, -reverse, forward)

Where the throttle asks for a speed, this is the speed that a controller is set to hold the car to.
Holds: a limit in software, or a power stage at its end.   Shows in: full throttle, both ways.
Source: clipping by definition; an F1TENTH asked for 5 m/s and held to 1.3 (FrictionMaps, DS3).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_saturation(throttle_received: float, forward: float, reverse: float) -> float:
    """Throttle within the limits, + forward."""
    return min(max(throttle_received, -reverse), forward)


TERM = Term(
    drive_saturation,
    per=Per.BODY,
    sets="throttle_limited",
    neutral={"forward": 1.0, "reverse": 1.0},
    shows_in=("top_speed", "throttle_ramp"),
    params=(
        Param("forward", 1.0, "1", "drive.limit_forward", (0.02, 1.0),
              "largest throttle that still acts", Normal(1.0, 0.2)),
        Param("reverse", 1.0, "1", "drive.limit_reverse", (0.02, 1.0),
              "largest reverse throttle that still acts", Normal(1.0, 0.2)),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.7,), (0.4,), (0.15,)), steps=(0.02,),
        parameters=("forward",), only_with="speed_control",
        sentence="Whatever is commanded, the drive takes no more than {forward} of full throttle.",
        advice="Look for a limit of speed or current in the controller's settings.",
    ),
)  # fmt: skip
