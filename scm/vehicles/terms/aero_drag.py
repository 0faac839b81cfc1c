"""Air drag on the body, against its whole motion through the air, wind included.

    u = velocity of the body - velocity of the air, in the body frame
    force_x += -coefficient * |u| * u_x,  force_y += -coefficient * |u| * u_y    [N]

Holds: above walking pace, one coefficient for all directions.   Shows in: fast coast-down, wind.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 4; coefficient is rho c_d A / 2.
"""

import math

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_PARAMS = (
    Param("coefficient", 0.0, "N*s^2/m^2", "body.drag_quadratic_ns2_m2", (0.0, 5.0),
          "force over speed squared", LogNormal(0.01, 1.0)),
)  # fmt: skip


@kernel_function
def aero_drag_damping(
    vx: float, vy: float, air_x: float, air_y: float, cos_yaw: float, sin_yaw: float,
    coefficient: float,
) -> float:  # fmt: skip
    """Force lost per speed, the secant [N*s/m]."""
    along = vx - (cos_yaw * air_x + sin_yaw * air_y)
    across = vy - (cos_yaw * air_y - sin_yaw * air_x)
    return coefficient * math.sqrt(along * along + across * across)


@kernel_function
def aero_drag(
    vx: float, vy: float, air_x: float, air_y: float, cos_yaw: float, sin_yaw: float,
    coefficient: float,
) -> float:  # fmt: skip
    """Force along the body, + forward [N]."""
    secant = aero_drag_damping(vx, vy, air_x, air_y, cos_yaw, sin_yaw, coefficient)
    return -secant * (vx - (cos_yaw * air_x + sin_yaw * air_y))


@kernel_function
def aero_drag_across(
    vx: float, vy: float, air_x: float, air_y: float, cos_yaw: float, sin_yaw: float,
    coefficient: float,
) -> float:  # fmt: skip
    """Force across the body, + to its left [N]."""
    secant = aero_drag_damping(vx, vy, air_x, air_y, cos_yaw, sin_yaw, coefficient)
    return -secant * (vy - (cos_yaw * air_y - sin_yaw * air_x))


TERM = Term(
    aero_drag, per=Per.BODY, adds="force_x", damping=aero_drag_damping, passive=True,
    neutral={"coefficient": 0.0}, params=_PARAMS, shows_in=("coast_down",),
    also=(Term(aero_drag_across, per=Per.BODY, adds="force_y", damping=aero_drag_damping,
               passive=True, neutral={"coefficient": 0.0}, params=_PARAMS, shows_in=("wind",)),),
    identification=Identification(
        equation="body", depends_on=("speed",), starts=((0.1,), (0.5,)), steps=(0.05,),
        needs_mps=0.5, adds=True,
        sentence="Something brakes the car with the square of its speed, {coefficient}.",
        advice="Nothing to repair unless something sticks out of the car. Keep the drag in the "
               "simulator for fast drives.",
    ),
)  # fmt: skip
