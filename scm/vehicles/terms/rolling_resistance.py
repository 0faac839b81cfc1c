"""Rolling resistance: the tyre's hysteresis turns rolling into heat and holds a wheel at rest.

    dry_torque += (c_rr + rolling) * load * wheel_radius    [N*m]

rolling is what the floor under the wheel adds.

Holds: hard floor, below 15 m/s.   Shows in: coast-down that stops too late.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 4.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def rolling_resistance(
    load: float, rolling: float, wheel_radius: float, coefficient: float
) -> float:
    """Torque that dry friction can hold, never negative [N*m]."""
    return (coefficient + rolling) * load * wheel_radius


TERM = Term(
    rolling_resistance,
    per=Per.WHEEL,
    adds="dry_torque",
    passive=True,
    neutral={"coefficient": 0.0},
    shows_in=("coast_down",),
    params=(
        Param(
            "coefficient", 0.0, "1", "wheel.rolling_resistance", (0.0, 0.2),
            "resisting force over load", LogNormal(0.015, 0.7),
        ),
    ),
    identification=Identification(
        equation="drive", depends_on=("constant",), starts=((0.01,), (0.03,), (0.08,)),
        steps=(0.005,), adds=True,
        sentence="Rolling resistance is {coefficient} of the weight.",
        advice="Look at tyre pressure, rubbing wheels and the kind of floor.",
    ),
)  # fmt: skip
