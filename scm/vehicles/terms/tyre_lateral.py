"""Lateral tyre force: grip against side slip, the paper's two cubics times the load.

    tyre_y += -load * grip * F(slip),  slip = slip_scale * v_lat / max(|v_long|, low_speed)    [N]

A tyre with memory (tyre_relaxation) has (v_lat + m side_lag) / max(|v_long| + m, low_speed) as
its slip, m = side_lag_speed; without, m = 0.

Holds: dry floor; independent of longitudinal slip, as in the paper; no rise of grip per load.
Shows in: fast circles, lane changes.   Source: AutoDRIVE paper, tyre model (two cubics).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term
from scm.vehicles.tyre_curve import curve_over_slip


@kernel_function
def tyre_lateral(
    v_long: float, v_lat: float, grip_load: float, grip: float, slip_scale: float, side_lag: float,
    side_lag_speed: float, slip_extremum: float, force_extremum: float, slip_asymptote: float,
    force_asymptote: float, low_speed: float,
) -> float:  # fmt: skip
    """Force across the wheel, + to its left [N]."""
    speed = max(abs(v_long) + side_lag_speed, low_speed)
    slip = slip_scale * (v_lat + side_lag_speed * side_lag) / speed
    return -grip_load * grip * slip * curve_over_slip(
        slip, slip_extremum, force_extremum, slip_asymptote, force_asymptote
    )  # fmt: skip


@kernel_function
def tyre_lateral_damping(
    v_long: float, v_lat: float, grip_load: float, grip: float, slip_scale: float, side_lag: float,
    side_lag_speed: float, slip_extremum: float, force_extremum: float, slip_asymptote: float,
    force_asymptote: float, low_speed: float,
) -> float:  # fmt: skip
    """Force per side speed, the secant: beyond the peak it never overshoots zero slip [N*s/m]."""
    speed = max(abs(v_long) + side_lag_speed, low_speed)
    slip = slip_scale * (v_lat + side_lag_speed * side_lag) / speed
    return grip_load * grip * slip_scale / speed * curve_over_slip(
        slip, slip_extremum, force_extremum, slip_asymptote, force_asymptote
    )  # fmt: skip


TERM = Term(
    tyre_lateral,
    per=Per.WHEEL,
    adds="tyre_y",
    damping=tyre_lateral_damping,
    passive=True,
    shows_in=("fast_circle", "lane_change"),
    params=(
        Param("slip_extremum", 0.2, "1", "tyre.lateral_slip_extremum", (0.01, 1.0),
              "slip of most grip", LogNormal(0.2, 0.3)),
        Param("force_extremum", 1.0, "1", "tyre.lateral_force_extremum", (0.05, 3.0),
              "most force over load", LogNormal(0.9, 0.3)),
        Param("slip_asymptote", 0.5, "1", "tyre.lateral_slip_asymptote", (0.02, 3.0),
              "slip from where the tyre only slides", LogNormal(0.5, 0.3)),
        Param("force_asymptote", 0.75, "1", "tyre.lateral_force_asymptote", (0.02, 3.0),
              "sliding force over load", LogNormal(0.7, 0.3)),
        Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
              "floor of the slip's denominator", fit=False),
    ),
)  # fmt: skip
