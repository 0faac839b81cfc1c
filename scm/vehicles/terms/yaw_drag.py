"""Angular drag: slows the body's turning.

    moment_z += -coefficient * yaw_rate    [N*m]

Holds: slow air, cables.   Shows in: turns that end too soon.
Source: AutoDRIVE paper, rigid body angular drag.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def yaw_drag(yaw_rate: float, coefficient: float) -> float:
    """Moment against the turning [N*m]."""
    return -coefficient * yaw_rate


@kernel_function
def yaw_drag_damping(coefficient: float) -> float:
    """Moment lost per yaw rate [N*m*s]."""
    return coefficient


TERM = Term(
    yaw_drag,
    per=Per.BODY,
    adds="moment_z",
    damping=yaw_drag_damping,
    passive=True,
    neutral={"coefficient": 0.0},
    shows_in=("circle",),
    params=(
        Param("coefficient", 0.0, "N*m*s", "body.drag_angular_nms", (0.0, 2.0),
              "moment over yaw rate", LogNormal(1e-3, 1.0)),
    ),
)  # fmt: skip
