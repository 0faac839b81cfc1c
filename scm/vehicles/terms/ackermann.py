"""Ackermann linkage: both front wheels point at one turning centre, so the inner one turns more.

    wheel_slope = wheelbase * t / (wheelbase - side * track / 2 * t),  t = tan(road_angle)

Holds: perfect linkage, front axle only; + is left, where the left wheel (side = +1) is the inner.
Shows in: tight circles.   Source: geometry; the paper prints the opposite sign.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.term import Per, Term


@kernel_function
def ackermann(
    road_slope: float, front: float, side: float, wheelbase: float, track: float
) -> float:
    """Tangent of one wheel's angle, + left; 0 on the rear axle."""
    return front * wheelbase * road_slope / (wheelbase - 0.5 * track * side * road_slope)


TERM = Term(ackermann, per=Per.WHEEL, sets="wheel_slope", shows_in=("tight_circle",))
