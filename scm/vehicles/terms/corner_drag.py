"""Corner drag: turning costs speed, by tyres dragged sideways and scrubbing linkages.

    force_x += -coefficient * mass * |yaw_rate| * vx    [N]

The force is `coefficient` times the force that bends the path, and always against the motion.
Holds: forward and backward, below the tyres' peak.   Shows in: circles slower than straights.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 6 (cornering drag).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def corner_drag(vx: float, yaw_rate: float, mass: float, coefficient: float) -> float:
    """Force against the motion [N]."""
    return -coefficient * mass * abs(yaw_rate) * vx


@kernel_function
def corner_drag_damping(yaw_rate: float, mass: float, coefficient: float) -> float:
    """Force lost per speed [N*s/m]."""
    return coefficient * mass * abs(yaw_rate)


TERM = Term(
    corner_drag,
    per=Per.BODY,
    adds="force_x",
    damping=corner_drag_damping,
    passive=True,
    neutral={"coefficient": 0.0},
    shows_in=("circle", "fast_circle"),
    params=(
        Param("coefficient", 0.0, "1", "corner_drag.coefficient", (0.0, 3.0),
              "drag over cornering force", LogNormal(0.1, 1.0)),
    ),
    identification=Identification(
        equation="body", depends_on=("steering angle", "speed"), starts=((0.3,), (1.0,)),
        steps=(0.1,),
        sentence="Turning the wheels brakes the car: coefficient {coefficient}.",
        advice="Look for tyres that rub and for toe-in; push the car in a circle by hand and feel"
               " it.",
    ),
)  # fmt: skip
