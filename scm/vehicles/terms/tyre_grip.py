"""Tyre grip: more or less friction than the car file says, on any floor.

    grip = scale * grip_here,  both of the tyre's forces times grip

The whole curve shrinks: what the tyre can hold, and its steepness with it.
Holds: one tyre compound on one floor.   Shows in: fast circles, launch, hard braking.
Source: Coulomb friction; Pacejka, Tire and Vehicle Dynamics (scaling of peak friction).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def tyre_grip(grip_here: float, scale: float) -> float:
    """Factor of floor and tyre on the tyre's friction."""
    return scale * grip_here


TERM = Term(
    tyre_grip,
    per=Per.WHEEL,
    sets="grip",
    neutral={"scale": 1.0},
    shows_in=("fast_circle", "launch", "hard_braking"),
    params=(
        Param("scale", 1.0, "1", "tyre_grip.scale", (0.05, 3.0),
              "below 1 more slippery", LogNormal(1.0, 0.3)),
    ),
    identification=Identification(
        equation="tyre", depends_on=("slip",), starts=((0.7,), (1.2,)), steps=(0.05,), rare=4.0,
        needs_m_s2=1.0, bounds={"scale": (0.2, 2.0)},
        sentence="The tyres hold {scale} of their nominal side force.",
        experiments=("other_wheels",),
        advice="Clean tyres and floor; compare with a new set of tyres.",
        varies=True,
    ),
)  # fmt: skip
