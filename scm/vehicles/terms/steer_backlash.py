"""Steering backlash: the wheels follow the servo only after the play is used up.

    linkage_angle = clip(linkage_angle, servo_angle - width / 2, servo_angle + width / 2)    [rad]

Holds: wheels that stay where they are within the play.   Shows in: small reversals.
Source: play operator (Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_backlash(servo_angle: float, linkage_angle: float, width: float) -> float:
    """Angle behind the play at the substep's end, + left [rad]."""
    return min(max(linkage_angle, servo_angle - 0.5 * width), servo_angle + 0.5 * width)


TERM = Term(
    steer_backlash,
    per=Per.BODY,
    sets="linkage_angle",
    keeps=0.0,
    neutral={"width": 0.0},
    shows_in=("small_reversals", "slalom"),
    params=(
        Param("width", 0.0, "rad", "steering.backlash_rad", (0.0, 0.3),
              "full width of the play, at the wheels", LogNormal(0.03, 0.8), report="width_rad"),
    ),
    identification=Identification(
        equation="steering", depends_on=("steering history",), starts=((0.015,), (0.04,), (0.1,)),
        steps=(0.01,),
        sentence="The steering has {width_rad} of play.",
        advice="Wiggle a front wheel by hand with the servo powered. Tighten or replace the ball "
               "joints of the linkage.",
        varies=True,
    ),
)  # fmt: skip
