"""Steering trim: the wheels stand off by an angle, whatever the command.

    steer_trimmed = linkage_angle + offset    [rad]

Holds: bent or badly set rod.   Shows in: straight drives.   Source: geometry; + turns left.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_trim(linkage_angle: float, offset: float) -> float:
    """Mean road-wheel angle, + left [rad]."""
    return linkage_angle + offset


TERM = Term(
    steer_trim,
    per=Per.BODY,
    sets="steer_trimmed",
    neutral={"offset": 0.0},
    shows_in=("straight",),
    params=(
        Param("offset", 0.0, "rad", "steering.trim_rad", (-0.3, 0.3),
              "added to the wheels' angle, + left", Normal(0.0, 0.03), report="offset_rad"),
    ),
    identification=Identification(
        equation="steering", depends_on=("constant",),
        starts=((0.02,), (-0.02,), (0.08,), (-0.08,)), steps=(0.005,),
        sentence="The wheels stand {offset_rad} to the left when the command is straight ahead.",
        advice="Set the steering's neutral: the car should roll straight with no command.",
    ),
)  # fmt: skip
