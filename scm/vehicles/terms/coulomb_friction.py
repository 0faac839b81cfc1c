"""Dry friction of a motor and its gear: nothing moves until the torque beats it.

    dry_torque += driven * torque    [N*m]

Holds: breakaway equal to sliding; `stiction` adds what fades.   Shows in: throttle ramps,
coasting to a sudden stop.
Source: textbook Coulomb friction; the real Nigel needs about 0.2 throttle to move.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def coulomb_friction(driven: float, torque: float) -> float:
    """Torque that dry friction can hold, never negative [N*m]."""
    return driven * torque


TERM = Term(
    coulomb_friction,
    per=Per.WHEEL,
    adds="dry_torque",
    passive=True,
    neutral={"torque": 0.0},
    shows_in=("throttle_ramp", "coast_down"),
    params=(
        Param("torque", 0.0, "N*m", "drive.coulomb_torque_nm", (0.0, 5.0),
              "per driven wheel", LogNormal(0.01, 1.0)),
    ),
)  # fmt: skip
