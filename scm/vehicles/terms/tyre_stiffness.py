"""Tyre stiffness: tyres slip sideways more or less under a force than the car file says.

    slip_scale = scale,  side slip times slip_scale before the tyre's curve

Cornering stiffness changes by `scale`, the most that the tyre can hold does not; driving and
braking keep their slip.
Holds: below the curve's peak.   Shows in: fast circles, steering steps.
Source: Pacejka, Tire and Vehicle Dynamics (similarity method, scaling of slip stiffness).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def tyre_stiffness(scale: float) -> float:
    """Factor on side slip."""
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
    identification=Identification(
        equation="tyre", depends_on=("slip",), starts=((0.4,), (0.7,), (1.5,)), steps=(0.05,),
        needs_m_s2=1.0, bounds={"scale": (0.2, 4.0)},
        sentence="The tyres answer side slip with {scale} of their nominal stiffness.",
        experiments=("other_wheels",),
        advice="Check tyre pressure and wear, and whether all four are of one kind.",
        own="tyre.lateral_slip_extremum",
        varies=True,
    ),
)  # fmt: skip
