"""Grade: the floor is one tilted plane, and gravity pulls the car down it.

    F = mass * gravity * slope / sqrt(1 + slope^2)        [N]
    force_x += -F * cos(uphill - yaw),  force_y += -F * sin(uphill - yaw)

The plane rises by `slope` toward the world direction `uphill`. The weight on the wheels stays as
on the level: 0.5 % too much at a slope of 0.1. Accelerometers feel no lean, only what the car does.
Holds: slopes below 0.3; a map's height map does the same locally, and tilts the car too.
Shows in: throttle held in several headings, rolling from rest.   Source: statics.
"""

import math

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import sin_cos
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term

_GRAVITY = 9.80665
_PARAMS = (
    Param("slope", 0.0, "1", "grade.slope", (-0.5, 0.5), "rise over run", Normal(0.0, 0.03)),
    Param("uphill", 0.0, "rad", "grade.uphill_rad", (-3.1416, 3.1416),
          "direction in the world that climbs", report="uphill_rad"),
)  # fmt: skip


@kernel_function
def downhill(mass: float, slope: float) -> float:
    """Gravity's pull along the plane [N]."""
    return mass * _GRAVITY * slope / math.sqrt(1.0 + slope * slope)


@kernel_function
def grade(mass: float, cos_yaw: float, sin_yaw: float, slope: float, uphill: float) -> float:
    """Force along the body, + forward [N]."""
    sin_up, cos_up = sin_cos(uphill)
    return -downhill(mass, slope) * (cos_up * cos_yaw + sin_up * sin_yaw)


@kernel_function
def grade_across(mass: float, cos_yaw: float, sin_yaw: float, slope: float, uphill: float) -> float:
    """Force across the body, + to its left [N]."""
    sin_up, cos_up = sin_cos(uphill)
    return -downhill(mass, slope) * (sin_up * cos_yaw - cos_up * sin_yaw)


TERM = Term(
    grade, per=Per.BODY, adds="force_x", neutral={"slope": 0.0}, params=_PARAMS,
    shows_in=("headings", "roll_from_rest"),
    also=(Term(grade_across, per=Per.BODY, adds="force_y", neutral={"slope": 0.0},
               params=_PARAMS, shows_in=("headings",)),),
    identification=Identification(
        equation="body", depends_on=("heading",),
        starts=((0.02, 0.0), (0.02, 1.57), (0.02, 3.14), (0.02, -1.57)), steps=(0.005, 0.1),
        rare=4.0, like="wind", shared="floor",
        sentence="The floor rises by {slope} towards {uphill_rad} from world x.",
        experiments=("rotated",),
        advice="Put a spirit level on the floor. Level the floor, or keep the slope in the "
               "simulator.",
        why_alike="Both push the car one way wherever it heads: no drive on this floor tells them"
                  " apart.",
    ),
)  # fmt: skip
