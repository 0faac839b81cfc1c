"""Lateral tyre force by Pacejka's magic formula, front and rear apart.

    tyre_y += -load * D sin(C atan(B alpha)),  alpha = atan(v_lat / max(|v_long|, low_speed))    [N]

Holds: steady slip; fitted on one floor.   Shows in: fast circles until the tyres give up.
Source: Pacejka, Tire and Vehicle Dynamics; values of Lorenzo-Lyons/DART.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lane_math import atan, sin_cos
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def tyre_pacejka_damping(
    v_long: float, v_lat: float, grip_load: float, grip: float, slip_scale: float, side_lag: float,
    side_lag_speed: float, front: float, low_speed: float, front_d: float, front_c: float,
    front_b: float, rear_d: float, rear_c: float, rear_b: float,
) -> float:  # fmt: skip
    """Force per side speed, the secant: beyond the peak it never overshoots zero slip [N*s/m]."""
    d = front_d if front > 0.5 else rear_d
    c = front_c if front > 0.5 else rear_c
    b = front_b if front > 0.5 else rear_b
    speed = max(abs(v_long) + side_lag_speed, low_speed)
    slip = abs(slip_scale * (v_lat + side_lag_speed * side_lag) / speed)
    sine, _cosine = sin_cos(c * atan(b * atan(slip)))
    secant = c * b if slip < 1e-6 else sine / max(slip, 1e-6)
    return grip_load * grip * slip_scale / speed * d * secant


@kernel_function
def tyre_pacejka(
    v_long: float, v_lat: float, grip_load: float, grip: float, slip_scale: float, side_lag: float,
    side_lag_speed: float, front: float, low_speed: float, front_d: float, front_c: float,
    front_b: float, rear_d: float, rear_c: float, rear_b: float,
) -> float:  # fmt: skip
    """Force across the wheel, + to its left [N]."""
    return -(v_lat + side_lag_speed * side_lag) * tyre_pacejka_damping(
        v_long, v_lat, grip_load, grip, slip_scale, side_lag, side_lag_speed, front, low_speed,
        front_d, front_c, front_b, rear_d, rear_c, rear_b,
    )  # fmt: skip


TERM = Term(
    tyre_pacejka,
    per=Per.WHEEL,
    adds="tyre_y",
    damping=tyre_pacejka_damping,
    passive=True,
    shows_in=("fast_circle",),
    params=(
        Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
              "floor of the slip's denominator", fit=False),
        Param("front_d", 0.841, "1", "tyre.front_d", (0.05, 3.0),
              "most force over load", LogNormal(0.85, 0.3)),
        Param("front_c", 0.841, "1", "tyre.front_c", (0.3, 1.99), "shape", LogNormal(0.9, 0.3)),
        Param("front_b", 8.60, "1", "tyre.front_b", (0.5, 40.0), "stiffness", LogNormal(9.0, 0.4)),
        Param("rear_d", 0.855, "1", "tyre.rear_d", (0.05, 3.0),
              "most force over load", LogNormal(0.85, 0.3)),
        Param("rear_c", 0.959, "1", "tyre.rear_c", (0.3, 1.99), "shape", LogNormal(0.9, 0.3)),
        Param("rear_b", 11.55, "1", "tyre.rear_b", (0.5, 40.0), "stiffness", LogNormal(11.0, 0.4)),
    ),
)  # fmt: skip
