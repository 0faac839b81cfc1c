"""Quasi-static load: accelerations move load at once, past springs and dampers.

    along  = (1 - 2 front) * mass * accel_x * cog_height / (2 wheelbase)                [N]
    across = -side * 2 rest_load / gravity * accel_y * cog_height / track               [N]
    grip_load = load + rigidity * (max(0, rest_load + along + across) - load)              [N]

The tyre's friction works with this load; springs still carry the body. rigidity = 0 leaves the load
as the suspension makes it, 1 takes the rigid car's, which answers within a substep.
Holds: level floor, equal roll stiffness of both axles over their load.
Shows in: fast lane changes of a car whose suspension is not known.
Source: Gillespie, Fundamentals of Vehicle Dynamics (1992), chapters 1 and 6.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Param
from scm.vehicles.term import Per, Term

_GRAVITY = 9.80665


@kernel_function
def load_quasistatic(
    load: float, rest_load: float, accel_x: float, accel_y: float, front: float, side: float,
    mass: float, wheelbase: float, track: float, cog_height: float, rigidity: float,
) -> float:  # fmt: skip
    """Load that the tyre's friction works with, never negative [N]."""
    along = (1.0 - 2.0 * front) * mass * accel_x * cog_height / (2.0 * wheelbase)
    across = -side * 2.0 * rest_load / _GRAVITY * accel_y * cog_height / track
    return load + rigidity * (max(0.0, rest_load + along + across) - load)


TERM = Term(
    load_quasistatic,
    per=Per.WHEEL,
    sets="grip_load",
    neutral={"rigidity": 0.0},
    shows_in=("lane_change", "hard_braking"),
    params=(
        Param("rigidity", 1.0, "1", "load_quasistatic.rigidity", (0.0, 1.0),
              "0 the suspension's load, 1 the rigid car's", fit=False),
    ),
)  # fmt: skip
