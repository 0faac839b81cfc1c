"""Rotor seen through its gear: makes a driven wheel heavy to spin up.

    extra_inertia += driven * inertia    [kg*m^2]

Holds: stiff gear without play.   Shows in: throttle steps, impacts.
Source: Fitzgerald, Electric Machinery: rotor inertia times gear ratio squared.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def reflected_inertia(driven: float, inertia: float) -> float:
    """Inertia beside the wheel's own [kg*m^2]."""
    return driven * inertia


TERM = Term(
    reflected_inertia,
    per=Per.WHEEL,
    adds="extra_inertia",
    passive=True,
    neutral={"inertia": 0.0},
    shows_in=("throttle_step",),
    params=(
        Param("inertia", 0.0, "kg*m^2", "drive.reflected_inertia_kgm2", (0.0, 1.0),
              "rotor through the gear, per driven wheel", LogNormal(5e-4, 0.7)),
    ),
)  # fmt: skip
