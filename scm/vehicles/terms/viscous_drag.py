"""Linear drag on the body, against its motion over the floor.

    force_x += -coefficient * vx,  force_y += -coefficient * vy    [N]

Holds: slow air, cables, grease.   Shows in: coast-down.   Source: AutoDRIVE paper, rigid body drag.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_PARAMS = (
    Param("coefficient", 0.0, "N*s/m", "body.drag_linear_ns_m", (0.0, 20.0),
          "force over speed", LogNormal(0.05, 1.0)),
)  # fmt: skip


@kernel_function
def viscous_drag(vx: float, coefficient: float) -> float:
    """Force along the body, + forward [N]."""
    return -coefficient * vx


@kernel_function
def viscous_drag_across(vy: float, coefficient: float) -> float:
    """Force across the body, + to its left [N]."""
    return -coefficient * vy


@kernel_function
def viscous_drag_damping(coefficient: float) -> float:
    """Force lost per speed [N*s/m]."""
    return coefficient


TERM = Term(
    viscous_drag, per=Per.BODY, adds="force_x", damping=viscous_drag_damping, passive=True,
    neutral={"coefficient": 0.0}, params=_PARAMS, shows_in=("coast_down",),
    also=(Term(viscous_drag_across, per=Per.BODY, adds="force_y", damping=viscous_drag_damping,
               passive=True, neutral={"coefficient": 0.0}, params=_PARAMS, shows_in=("slide",)),),
    identification=Identification(
        equation="body", depends_on=("speed",), starts=((0.4,), (1.5,), (4.0,)), steps=(0.1,),
        adds=True,
        sentence="Something brakes the car in proportion to its speed, {coefficient}.",
        advice="Turn the wheels by hand and look for thick grease, a cable that drags, or a soft "
               "floor.",
    ),
)  # fmt: skip
