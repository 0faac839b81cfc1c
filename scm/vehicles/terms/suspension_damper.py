"""Suspension damper: takes the swing out of a corner.

    suspension_force += damper * compression_rate    [N]

Holds: linear oil damper.   Shows in: pitch that swings after braking.
Source: AutoDRIVE paper, suspension (spring and damper at each corner).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def suspension_damper(compression_rate: float, damper: float) -> float:
    """Force on the body, + up [N]."""
    return damper * compression_rate


@kernel_function
def suspension_damper_damping(damper: float) -> float:
    """Force gained per compression rate [N*s/m]."""
    return damper


TERM = Term(
    suspension_damper,
    per=Per.WHEEL,
    adds="suspension_force",
    damping=suspension_damper_damping,
    passive=True,
    neutral={"damper": 0.0},
    shows_in=("hard_braking",),
    params=(
        Param("damper", 60.0, "N*s/m", "suspension.damper_ns_m", (0.0, 2e4),
              "one corner", LogNormal(60.0, 0.4)),
    ),
)  # fmt: skip
