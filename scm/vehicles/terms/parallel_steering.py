"""Parallel linkage: both front wheels turn by the same angle, so in a turn they scrub.

    wheel_slope = tan(road_angle)

Holds: front axle only. List it instead of ackermann.
Shows in: tight circles, wider and slower than with an Ackermann linkage.
Source: geometry; CommonRoad's multi-body model steers so.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.term import Per, Term


@kernel_function
def parallel_steering(road_slope: float, front: float) -> float:
    """Tangent of one wheel's angle, + left; 0 on the rear axle."""
    return front * road_slope


TERM = Term(parallel_steering, per=Per.WHEEL, sets="wheel_slope", shows_in=("tight_circle",))
