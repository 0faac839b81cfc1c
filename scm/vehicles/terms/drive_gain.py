"""Drive gain: every motor gives so many times its nominal torque.

    drive_strength = gain * warm_strength

On a level floor a weak motor looks like a heavy car (`payload`): a ramp or a known weight tells.
Holds: whole torque-speed line scaled, no-load speed as it was.   Shows in: throttle steps.
Source: DC motor of another magnet or gear loss; the definition is ours.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def drive_gain(warm_strength: float, gain: float) -> float:
    """Torque over the nominal one."""
    return gain * warm_strength


TERM = Term(
    drive_gain,
    per=Per.WHEEL,
    sets="drive_strength",
    neutral={"gain": 1.0},
    shows_in=("throttle_step", "hard_launch"),
    params=(
        Param("gain", 1.0, "1", "drive.gain", (0.1, 3.0),
              "torque over nominal", LogNormal(1.0, 0.3)),
    ),
)  # fmt: skip
