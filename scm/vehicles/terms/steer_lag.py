"""Steering lag: the wheels' angle follows its demand through a first-order lag.

    steer_target += (steer_scaled - steer_target) * dt / (time_constant + dt)    [rad]

Holds: one dominant time constant.   Shows in: steering steps.
Source: Lorenzo-Lyons/DART, vehicle model (steering time constant).
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_lag(steer_scaled: float, steer_target: float, time_constant: float, dt: float) -> float:
    """Angle that the servo is asked for at the substep's end, + left [rad]."""
    share = dt / (time_constant + dt)
    return share * steer_scaled + (1.0 - share) * steer_target


TERM = Term(
    steer_lag,
    per=Per.BODY,
    sets="steer_target",
    keeps=0.0,
    neutral={"time_constant": 0.0},
    shows_in=("steering_step",),
    params=(
        Param("time_constant", 0.0, "s", "steering.lag_s", (0.0, 2.0),
              "63 % of a step", LogNormal(0.05, 0.8), report="time_constant_s"),
    ),
    identification=Identification(
        equation="steering", depends_on=("steering",), starts=((0.02,), (0.04,), (0.08,), (0.16,)),
        steps=(0.01,),
        sentence="The steering follows sluggishly, with a time constant of {time_constant_s}.",
        advice="Look for a filter on the steering command or a worn servo. Keep the lag in the "
               "simulator if it belongs there.",
        varies=True,
    ),
)  # fmt: skip
