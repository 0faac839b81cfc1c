"""Steering command to angle through a linkage that saturates differently left and right.

    s = steering + offset
    steer_demand = left * tanh(left_slope * s) if s > 0, else right * tanh(right_slope * s)

Holds: commands in [-1, 1].   Shows in: slow circles, both ways.
Source: Lorenzo-Lyons/DART, vehicle model (steering curve).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import tanh
from scm.vehicles.param import LogNormal, Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def steer_map_tanh(
    steering: float, left: float, left_slope: float, right: float, right_slope: float, offset: float
) -> float:
    """Mean road-wheel angle that the command means, + left [rad]."""
    s = min(max(steering, -1.0), 1.0) + offset
    return (left if s > 0.0 else right) * tanh((left_slope if s > 0.0 else right_slope) * s)


TERM = Term(
    steer_map_tanh,
    per=Per.BODY,
    sets="steer_demand",
    shows_in=("slow_circle",),
    params=(
        Param("left", 0.366, "rad", "steering.map_left_rad", (0.05, 1.2),
              "angle that a left command tends to", LogNormal(0.4, 0.3)),
        Param("left_slope", 1.393, "1", "steering.map_left_slope", (0.1, 10.0),
              "how soon it gets there", LogNormal(1.2, 0.4)),
        Param("right", 0.515, "rad", "steering.map_right_rad", (0.05, 1.2),
              "angle that a right command tends to", LogNormal(0.4, 0.3)),
        Param("right_slope", 1.023, "1", "steering.map_right_slope", (0.1, 10.0),
              "how soon it gets there", LogNormal(1.2, 0.4)),
        Param("offset", 0.0, "1", "steering.map_offset", (-0.3, 0.3),
              "added to the command", Normal(0.0, 0.05)),
    ),
)  # fmt: skip
