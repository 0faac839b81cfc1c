"""Tyre stiffness: the tyre slips more or less under a force than the car file says.

    slip_scale = scale,  slip of both directions times slip_scale, before the tyre's curve

The steepness at small slip changes by `scale`, the most that the tyre can hold does not.
Holds: below the curve's peak.   Shows in: fast circles, steering steps.
Source: Pacejka, Tire and Vehicle Dynamics (similarity method, scaling of slip stiffness).
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def tyre_stiffness(scale: float) -> float:
    """Factor on both slips."""
    return scale


TERM = Term(
    tyre_stiffness,
    per=Per.WHEEL,
    sets="slip_scale",
    neutral={"scale": 1.0},
    shows_in=("fast_circle", "steering_step"),
    params=(
        Param("scale", 1.0, "1", "tyre_stiffness.scale", (0.1, 5.0),
              "below 1 softer", LogNormal(1.0, 0.4)),
    ),
)  # fmt: skip
