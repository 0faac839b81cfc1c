"""Ackermann linkage: both front wheels point at one turning centre, so the inner one turns more.

    tan(wheel_steer) = wheelbase * t / (wheelbase - side * track / 2 * t),  t = tan(road_angle)

Holds: perfect linkage, front axle only; + is left, where the left wheel (side = +1) is the inner.
Shows in: tight circles.   Source: geometry; the paper prints the opposite sign.
"""

import math

from scm.vehicles.jit import law
from scm.vehicles.term import Per, Term


@law
def ackermann(
    road_angle: float, front: float, side: float, wheelbase: float, track: float
) -> float:
    """Angle of one wheel, + left; 0 on the rear axle [rad]."""
    if front == 0.0 or road_angle == 0.0:
        return 0.0
    slope = math.tan(road_angle)
    return math.atan(wheelbase * slope / (wheelbase - side * 0.5 * track * slope))


TERM = Term(ackermann, per=Per.WHEEL, sets="wheel_steer", shows_in=("tight_circle",))
