"""Suspension spring: carries a corner of the body.

    suspension_force += rest_spring_force + spring * compression    [N]

Holds: linear within its travel.   Shows in: roll in circles, pitch when braking.
Source: AutoDRIVE paper, suspension (spring and damper at each corner).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def suspension_spring(compression: float, rest_spring_force: float, spring: float) -> float:
    """Force on the body, + up [N]."""
    return rest_spring_force + spring * compression


@kernel_function
def suspension_spring_damping(spring: float, dt: float) -> float:
    """Force gained per compression rate within one substep [N*s/m]."""
    return spring * dt


TERM = Term(
    suspension_spring,
    per=Per.WHEEL,
    adds="suspension_force",
    damping=suspension_spring_damping,
    shows_in=("circle", "hard_braking"),
    params=(
        Param("spring", 2500.0, "N/m", "suspension.spring_n_m", (50.0, 2e5),
              "one corner", LogNormal(2500.0, 0.4)),
    ),
)  # fmt: skip
