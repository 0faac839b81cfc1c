"""Steering saturation: an end stop on either side cuts the command short.

    steering = clip(steering_received, -right, left)

Holds: stops hard against the servo.   Shows in: tightest circles, both ways.
Source: geometry; both numbers are shares of full command, + both, 1 where nothing is cut.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_saturation(steering_received: float, left: float, right: float) -> float:
    """Command within the stops, + left."""
    return min(max(steering_received, -right), left)


TERM = Term(
    steer_saturation,
    per=Per.BODY,
    sets="steering",
    neutral={"left": 1.0, "right": 1.0},
    shows_in=("tight_circle",),
    params=(
        Param("left", 1.0, "1", "steering.stop_left", (0.1, 1.0),
              "largest left command that still acts", Normal(1.0, 0.2)),
        Param("right", 1.0, "1", "steering.stop_right", (0.1, 1.0),
              "largest right command that still acts", Normal(1.0, 0.2)),
    ),
    identification=Identification(
        equation="steering", depends_on=("steering",), starts=((0.7, 1.0), (1.0, 0.7), (0.7, 0.7)),
        steps=(0.02, 0.02), bounds={"left": (0.3, 1.0), "right": (0.3, 1.0)},
        sentence="The steering ends at {left} of full lock on the left and {right} on the right.",
        advice="Steer to both ends: find what stops the wheels early (linkage, wheel arch, end "
               "point of the servo).",
    ),
)  # fmt: skip
