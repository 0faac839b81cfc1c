"""Motor gain: every motor gives so many times its nominal torque at any speed.

    motor_strength = gain * warm_strength

On a level floor a weak motor looks like a heavy car (`payload`): a ramp or a known weight tells.
Holds: torque-speed line scaled as a whole, no-load speed as it was.   Shows in: throttle steps.
Source: DC motor with other resistance (Fitzgerald, Electric Machinery); definition ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_gain(warm_strength: float, gain: float) -> float:
    """Torque over the nominal one."""
    return gain * warm_strength


TERM = Term(
    motor_gain,
    per=Per.WHEEL,
    sets="motor_strength",
    neutral={"gain": 1.0},
    shows_in=("throttle_step", "hard_launch"),
    params=(
        Param("gain", 1.0, "1", "motor.gain", (0.1, 3.0),
              "torque over nominal", LogNormal(1.0, 0.3)),
    ),
    identification=Identification(
        equation="drive", depends_on=("torque",), starts=((0.9,), (1.1,), (0.75,), (1.3,)),
        steps=(0.03,), rare=14.0, like="payload",
        sentence="The motors give {gain} of their torque.",
        advice="Weigh the car and measure its pull with a spring scale: motor or mass, one of "
               "both is off.",
        own="drive.stall_torque_nm",
    ),
)  # fmt: skip
