"""Motor fade: a motor that works loses torque within a minute or so, and rest brings it back.

    fade_strength += (1 - fraction * motor_throttle^2 - fade_strength) * dt / (warm_time + dt)

Holds: one dominant time constant of warming; load taken as the throttle.   Shows in: long drives
with a pause.   Source: first-order motor warming (Fitzgerald, Electric Machinery), strength ours.
"""

from scm.vehicles.jit import law
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@law
def motor_fade(
    fade_strength: float, motor_throttle: float, fraction: float, warm_time: float, dt: float
) -> float:
    """Torque that is left, over the cold motor's."""
    goal = 1.0 - fraction * min(motor_throttle * motor_throttle, 1.0)
    return fade_strength + (goal - fade_strength) * (dt / (warm_time + dt))


TERM = Term(
    motor_fade,
    per=Per.WHEEL,
    sets="fade_strength",
    keeps=1.0,
    neutral={"fraction": 0.0},
    shows_in=("long_drive", "rest_and_repeat"),
    params=(
        Param("fraction", 0.0, "1", "drive.fade", (0.0, 0.9),
              "torque lost when warm at full throttle", LogNormal(0.1, 0.8)),
        Param("warm_time", 60.0, "s", "drive.fade_time_s", (1.0, 3600.0),
              "63 % of the way to warm", fit=False),
    ),
)  # fmt: skip
