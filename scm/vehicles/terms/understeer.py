"""Understeer: the front wheels point less into a turn the harder the car turns.

    road_angle = steer_angle - gradient * vx * yaw_rate    [rad]

So a steady turn has curvature road_angle / (wheelbase + gradient * vx^2) on top of what the tyres
give; below 0 the car oversteers. vx * yaw_rate is the lateral acceleration of a steady turn.
Holds: steady turns below the tyres' peak.   Shows in: circles at two speeds.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 6 (understeer gradient).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def understeer(steer_angle: float, vx: float, yaw_rate: float, gradient: float) -> float:
    """Mean angle at which the front wheels meet the floor, + left [rad]."""
    return steer_angle - gradient * vx * yaw_rate


TERM = Term(
    understeer,
    per=Per.BODY,
    sets="road_angle",
    neutral={"gradient": 0.0},
    shows_in=("circle", "fast_circle"),
    params=(
        Param("gradient", 0.0, "rad*s^2/m", "understeer.gradient", (-0.1, 0.5),
              "angle lost over lateral acceleration", Normal(0.0, 0.02)),
    ),
    identification=Identification(
        equation="steering", depends_on=("lateral acceleration",), starts=((0.01,), (0.05,)),
        steps=(0.003,), needs_m_s2=0.5,
        sentence="The car turns less the faster it corners: {gradient}.",
        advice="Compare front and rear tyres; look for play or softness in front. If they are "
               "right, keep it in the simulator.",
        varies=True,
    ),
)  # fmt: skip
