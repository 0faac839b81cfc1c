"""Drive asymmetry: one side's motors are stronger, so throttle turns the car.

    motor_throttle = throttle * (1 + side * difference),  side = +1 left, -1 right

Holds: each driven wheel has its motor.   Shows in: straight drives, forward against reverse.
Source: geometry of unequal motors; + makes the left side stronger and the car turn right.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_asymmetry(throttle: float, side: float, difference: float) -> float:
    """Throttle of this side's motor, + forward."""
    return throttle * (1.0 + side * difference)


TERM = Term(
    drive_asymmetry,
    per=Per.WHEEL,
    sets="motor_throttle",
    neutral={"difference": 0.0},
    shows_in=("straight", "shuttle"),
    params=(
        Param("difference", 0.0, "1", "drive.asymmetry", (-0.6, 0.6),
              "half the difference left to right, over the mean", Normal(0.0, 0.1)),
    ),
    identification=Identification(
        equation="drive", depends_on=("side",), starts=((0.05,), (-0.05,), (0.15,), (-0.15,)),
        steps=(0.02,),
        sentence="The left motor pulls {difference} more than nominal, the right one as much less.",
        advice="Compare left and right: motor current, wheel diameter, and whether one wheel "
               "drags.",
        turns=True,
        varies=True,
    ),
)  # fmt: skip
