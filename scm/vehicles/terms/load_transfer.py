"""Load transfer: a higher centre of gravity moves more load in turns and stops.

    added_cog_z += height    [m]

The suspension turns it into roll, pitch and load transfer, as it moves (dynamic load transfer).
Holds: while all wheels carry load.   Shows in: fast circles, hard braking.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapters 1 and 6.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@law
def load_transfer(height: float) -> float:
    """Centre of gravity above where the car file puts it [m]."""
    return height


TERM = Term(
    load_transfer,
    per=Per.BODY,
    adds="added_cog_z",
    neutral={"height": 0.0},
    shows_in=("fast_circle", "hard_braking"),
    params=(
        Param("height", 0.0, "m", "load_transfer.height_m", (-0.2, 0.3),
              "+ higher", Normal(0.0, 0.02), report="height_m"),
    ),
)  # fmt: skip
