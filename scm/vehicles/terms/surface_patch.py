"""Surface patch: a round spot of floor has other grip and other rolling resistance.

    inside = clip(1/2 + (radius - distance) / edge, 0, 1),  edge = 0.02 m
    grip_here = floor_grip * (1 + (grip - 1) * inside),  rolling = floor_rolling + rolling * inside

Each wheel feels what lies under its own contact point. The edge is as wide as a contact patch.
Holds: one spot.   Shows in: laps that cross the spot, coasting over it.
Source: ours; carpets, tape and spills in the DART recordings.
"""

import math

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_SPOT = (
    Param("x", 0.0, "m", "surface_patch.x_m", (-100.0, 100.0), "middle, world x", report="x_m"),
    Param("y", 0.0, "m", "surface_patch.y_m", (-100.0, 100.0), "middle, world y", report="y_m"),
    Param("radius", 0.4, "m", "surface_patch.radius_m", (0.02, 20.0), "of the spot",
          LogNormal(0.5, 0.7), report="radius_m"),
)  # fmt: skip
_GRIP = Param("patch_grip", 1.0, "1", "surface_patch.grip", (0.05, 2.0),
              "factor on the tyre's friction", LogNormal(1.0, 0.5), report="grip")  # fmt: skip
_ROLLING = Param("patch_rolling", 0.0, "1", "surface_patch.rolling", (0.0, 0.5),
                 "added coefficient", LogNormal(0.03, 1.0), report="rolling")  # fmt: skip


@kernel_function
def inside(x_wheel: float, y_wheel: float, x: float, y: float, radius: float) -> float:
    """How much of the contact patch lies on the spot, 0 to 1."""
    away_x, away_y = x_wheel - x, y_wheel - y
    return min(max(0.5 + 50.0 * (radius - math.sqrt(away_x * away_x + away_y * away_y)), 0.0), 1.0)


@kernel_function
def surface_patch(
    x_wheel: float, y_wheel: float, floor_grip: float, x: float, y: float, radius: float,
    patch_grip: float,
) -> float:  # fmt: skip
    """Factor of this spot of floor on the tyre's friction."""
    return floor_grip * (1.0 + (patch_grip - 1.0) * inside(x_wheel, y_wheel, x, y, radius))


@kernel_function
def surface_patch_rolling(
    x_wheel: float, y_wheel: float, floor_rolling: float, x: float, y: float, radius: float,
    patch_rolling: float,
) -> float:  # fmt: skip
    """Added coefficient of rolling resistance."""
    return floor_rolling + patch_rolling * inside(x_wheel, y_wheel, x, y, radius)


TERM = Term(
    surface_patch, per=Per.WHEEL, sets="grip_here", neutral={"patch_grip": 1.0},
    params=(*_SPOT, _GRIP), shows_in=("laps", "coast_down"),
    also=(Term(surface_patch_rolling, per=Per.WHEEL, sets="rolling",
               neutral={"patch_rolling": 0.0}, params=(*_SPOT, _ROLLING), shows_in=("laps",)),),
    identification=Identification(
        equation="surface", depends_on=("position",), starts=(), steps=(0.1, 0.1, 0.05, 0.1, 0.01),
        shared="floor",
        sentence="A spot of floor near ({x_m}, {y_m}), {radius_m} in radius, has grip {grip} and "
                 "rolling resistance {rolling}.",
        experiments=("rotated",),
        advice="Look at the floor at the marked place: dust, tape, a wet spot, another material. "
               "Clean it, or keep it on the map.",
    ),
)  # fmt: skip
