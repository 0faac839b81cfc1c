"""Carpet nap: the pile of a carpet lies one way, so rolling against it costs more.

    force_x += -coefficient * (1 - cos(yaw - along)) * vx    [N]

Holds: slow cars on one carpet.   Shows in: circles that are slower on one side.
Source: ours, an example of an effect in a file of one's own.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import sin_cos
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def carpet_nap_damping(cos_yaw: float, sin_yaw: float, coefficient: float, along: float) -> float:
    """Force lost per speed [N*s/m]."""
    sin_along, cos_along = sin_cos(along)
    return coefficient * (1.0 - cos_yaw * cos_along - sin_yaw * sin_along)


@kernel_function
def carpet_nap(
    vx: float, cos_yaw: float, sin_yaw: float, coefficient: float, along: float
) -> float:
    """Force against the motion [N]."""
    return -vx * carpet_nap_damping(cos_yaw, sin_yaw, coefficient, along)


TERM = Term(
    carpet_nap,
    per=Per.BODY,
    adds="force_x",
    damping=carpet_nap_damping,
    passive=True,
    neutral={"coefficient": 0.0},
    shows_in=("slow_circle",),
    params=(
        Param("coefficient", 0.0, "N*s/m", "carpet_nap.coefficient_ns_m", (0.0, 50.0),
              "half of what it costs against the pile", LogNormal(2.0, 1.0)),
        Param("along", 0.0, "rad", "carpet_nap.along_rad", (-3.1416, 3.1416),
              "direction in the world in which the pile lies"),
    ),
)  # fmt: skip
