"""Drive gain: the controller takes every throttle so many times larger.

    throttle_scaled = gain * throttle_curved

Torque at stall and no-load speed grow alike; `motor_gain` leaves the no-load speed.
Holds: below full throttle's limit.   Shows in: steady speed at any throttle.
Source: a motor controller's scale (voltage, pulse width); the definition is ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_gain(throttle_curved: float, gain: float) -> float:
    """Throttle as the controller takes it, + forward."""
    return gain * throttle_curved


TERM = Term(
    drive_gain,
    per=Per.BODY,
    sets="throttle_scaled",
    neutral={"gain": 1.0},
    shows_in=("steady_speed", "throttle_step"),
    params=(
        Param("gain", 1.0, "1", "drive.gain", (0.1, 3.0),
              "throttle taken over throttle given", LogNormal(1.0, 0.3)),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.9,), (1.1,), (0.75,), (1.3,)),
        steps=(0.02,),
        sentence="The car drives as if the throttle were {gain} of the command.",
        advice="Check the throttle's end points in the controller, and the battery's voltage.",
    ),
)  # fmt: skip
