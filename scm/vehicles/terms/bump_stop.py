"""Bump stop: ends the suspension's travel, either way.

    suspension_force += stop_stiffness * (compression - clip(compression, -travel, travel))    [N]

Holds: hard rubber.   Shows in: landings, kerbs.   Source: ours, ten times a stiff spring.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def bump_stop(compression: float, travel: float, stop_stiffness: float) -> float:
    """Force on the body, + up [N]."""
    return stop_stiffness * (compression - min(max(compression, -travel), travel))


@kernel_function
def bump_stop_damping(compression: float, travel: float, stop_stiffness: float, dt: float) -> float:
    """Force gained per compression rate within one substep, while at the stop [N*s/m]."""
    return stop_stiffness * dt if abs(compression) > travel else 0.0


TERM = Term(
    bump_stop,
    per=Per.WHEEL,
    adds="suspension_force",
    damping=bump_stop_damping,
    neutral={"stop_stiffness": 0.0},
    shows_in=("landing",),
    params=(
        Param("travel", 0.005, "m", "suspension.travel_m", (1e-4, 0.2),
              "from rest to the stop, either way", LogNormal(0.005, 0.5)),
        Param("stop_stiffness", 2.5e4, "N/m", "suspension.stop_n_m", (0.0, 1e6),
              "of the stop", fit=False),
    ),
)  # fmt: skip
