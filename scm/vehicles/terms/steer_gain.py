"""Steering gain: every angle that a command means comes out so many times larger.

    steer_scaled = gain * steer_demand    [rad]

Holds: another horn or rod length, small angles.   Shows in: slow circles of any radius.
Source: linkage geometry, first order; at speed `understeer` looks alike, slow circles tell.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_gain(steer_demand: float, gain: float) -> float:
    """Mean road-wheel angle meant, + left [rad]."""
    return gain * steer_demand


TERM = Term(
    steer_gain,
    per=Per.BODY,
    sets="steer_scaled",
    neutral={"gain": 1.0},
    shows_in=("slow_circle",),
    params=(
        Param("gain", 1.0, "1", "steering.gain", (0.2, 2.0),
              "angle over the angle meant", LogNormal(1.0, 0.15)),
    ),
    identification=Identification(
        equation="steering", depends_on=("steering",), starts=((0.9,), (1.1,), (0.75,), (1.3,)),
        steps=(0.02,),
        sentence="The wheels turn by {gain} of the commanded angle.",
        advice="Measure the wheels' angle at half command, and correct the servo's travel or the "
               "car file.",
    ),
)  # fmt: skip
