"""Steering command to angle: full command is the steering's stop, the same on both sides.

    steer_demand = limit * clip(steering, -1, 1)    [rad]

Holds: linear linkage.   Shows in: circles at any steering.   Source: AutoDRIVE paper, steering.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_limit(steering: float, limit: float) -> float:
    """Mean road-wheel angle that the command means, + left [rad]."""
    return limit * min(max(steering, -1.0), 1.0)


TERM = Term(
    steer_limit,
    per=Per.BODY,
    sets="steer_demand",
    shows_in=("circle",),
    params=(
        Param("limit", 0.5235988, "rad", "steering.limit_rad", (0.05, 1.2),
              "angle at full command", LogNormal(0.5, 0.2)),
    ),
)  # fmt: skip
