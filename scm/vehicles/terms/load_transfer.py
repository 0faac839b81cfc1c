"""Load transfer: a higher centre of gravity moves more load in turns and stops.

    added_cog_z += height    [m]

The suspension turns it into roll, pitch and load transfer, as it moves (dynamic load transfer).
Holds: while all wheels carry load.   Shows in: fast circles, hard braking.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapters 1 and 6.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
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
    identification=Identification(
        equation="tyre", depends_on=("lateral acceleration",), starts=((0.05,), (-0.03,)),
        steps=(0.01,), rare=6.0, needs_m_s2=1.0, stays_above="body.cog_height_m",
        sentence="Load moves between the wheels as if the centre of gravity were {height_m} "
                 "higher.",
        advice="Measure the height of the centre of gravity: tilt the car until it tips.",
    ),
)  # fmt: skip
