"""Wind: a steady force in one direction of the world, of a fan, a cable or a draught.

    force_x += push_x * cos(yaw) + push_y * sin(yaw)    [N]
    force_y += push_y * cos(yaw) - push_x * sin(yaw)    [N]

Holds: force at the centre of gravity that depends on neither speed nor place. Wind that is known
as a velocity (`air_x`, `air_y` of the map) is felt through aero_drag instead.
Shows in: throttle held in several headings, coasting.   Source: Newton's second law.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term

_PARAMS = (
    Param("push_x", 0.0, "N", "wind.force_x_n", (-50.0, 50.0),
          "along world x", Normal(0.0, 0.5), report="force_x_n"),
    Param("push_y", 0.0, "N", "wind.force_y_n", (-50.0, 50.0),
          "along world y", Normal(0.0, 0.5), report="force_y_n"),
)  # fmt: skip
_NEUTRAL = {"push_x": 0.0, "push_y": 0.0}


@kernel_function
def wind(cos_yaw: float, sin_yaw: float, push_x: float, push_y: float) -> float:
    """Force along the body, + forward [N]."""
    return push_x * cos_yaw + push_y * sin_yaw


@kernel_function
def wind_across(cos_yaw: float, sin_yaw: float, push_x: float, push_y: float) -> float:
    """Force across the body, + to its left [N]."""
    return push_y * cos_yaw - push_x * sin_yaw


TERM = Term(
    wind, per=Per.BODY, adds="force_x", neutral=_NEUTRAL, params=_PARAMS,
    shows_in=("headings", "coast_down"),
    also=(Term(wind_across, per=Per.BODY, adds="force_y", neutral=_NEUTRAL, params=_PARAMS,
               shows_in=("headings",)),),
    identification=Identification(
        equation="body", depends_on=("heading",),
        starts=((0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)), steps=(0.05, 0.05), rare=10.0,
        bounds={"force_x_n": (-20.0, 20.0)}, like="grade", shared="floor",
        sentence="A steady push of {force_x_n} and {force_y_n} along the floor's x and y.",
        experiments=("rotated",),
        advice="Look for a fan, a draught or a cable that pulls the car one way.",
    ),
)  # fmt: skip
