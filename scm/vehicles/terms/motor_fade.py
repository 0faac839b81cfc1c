"""Motor fade: a drive that works weakens within a minute or so, and rest brings it back.

    fade_strength += (1 - 3 * fraction * load^2 - fade_strength) * dt / (warm_time + dt)
    load = fade_strength * motor_throttle

Stall torque and no-load speed shrink alike, as with a falling voltage. The three makes `fraction`
the loss at a usual load: 1/3 is the mean square of throttles spread evenly over 0 to 1.
Holds: one time constant of warming.   Shows in: long drives with a pause.
Source: first-order warming (Fitzgerald, Electric Machinery); the strength's form is ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def motor_fade(
    fade_strength: float, motor_throttle: float, fraction: float, warm_time: float, dt: float
) -> float:
    """Drive that is left, over the cold one."""
    load = fade_strength * motor_throttle
    goal = 1.0 - 3.0 * fraction * load * load
    return fade_strength + (goal - fade_strength) * (dt / (warm_time + dt))


TERM = Term(
    motor_fade,
    per=Per.WHEEL,
    sets="fade_strength",
    keeps=1.0,
    neutral={"fraction": 0.0},
    shows_in=("long_drive", "rest_and_repeat"),
    params=(
        Param("fraction", 0.0, "1", "drive.fade", (0.0, 0.9),
              "drive lost when warm at a usual load", LogNormal(0.1, 0.8)),
        Param("warm_time", 60.0, "s", "drive.fade_time_s", (1.0, 3600.0),
              "63 % of the way to warm", fit=False),
    ),
    identification=Identification(
        equation="drive", depends_on=("load", "time"), starts=((0.1,), (0.3,)), steps=(0.03,),
        sentence="The motors lose up to {fraction} of their drive as they warm up.",
        experiments=("cooled",),
        advice="Let the motor cool for five minutes and drive again: if the strength comes back, "
               "it is heat.",
    ),
)  # fmt: skip
