"""Longitudinal tyre force: grip against spin slip, the paper's two cubics times the load.

    tyre_x += load * grip * F(slip)    [N]
    slip = (wheel_radius * omega - v_long) / max(|v_long|, low_speed)

A tyre with memory (tyre_windup) has m spin_lag more above the line and m more beside |v_long|,
m = spin_lag_speed; without, m = 0.

Holds: dry floor; independent of lateral slip, as in the paper; no rise of grip per load.
Shows in: launch, hard braking.   Source: AutoDRIVE paper, tyre model (two cubics).
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term
from scm.vehicles.tyre_curve import curve_over_slip


@kernel_function
def tyre_longitudinal(
    omega: float, v_long: float, grip_load: float, grip: float, spin_lag: float,
    spin_lag_speed: float, wheel_radius: float, slip_extremum: float, force_extremum: float,
    slip_asymptote: float, force_asymptote: float, low_speed: float,
) -> float:  # fmt: skip
    """Force along the wheel, + forward [N]."""
    speed = max(abs(v_long) + spin_lag_speed, low_speed)
    slip = (wheel_radius * omega - v_long + spin_lag_speed * spin_lag) / speed
    return grip_load * grip * slip * curve_over_slip(
        slip, slip_extremum, force_extremum, slip_asymptote, force_asymptote
    )  # fmt: skip


@kernel_function
def tyre_longitudinal_damping(
    omega: float, v_long: float, grip_load: float, grip: float, spin_lag: float,
    spin_lag_speed: float, wheel_radius: float, slip_extremum: float, force_extremum: float,
    slip_asymptote: float, force_asymptote: float, low_speed: float,
) -> float:  # fmt: skip
    """Force per slip speed, the secant: beyond the peak it never overshoots zero slip [N*s/m]."""
    speed = max(abs(v_long) + spin_lag_speed, low_speed)
    slip = (wheel_radius * omega - v_long + spin_lag_speed * spin_lag) / speed
    return grip_load * grip / speed * curve_over_slip(
        slip, slip_extremum, force_extremum, slip_asymptote, force_asymptote
    )  # fmt: skip


TERM = Term(
    tyre_longitudinal,
    per=Per.WHEEL,
    adds="tyre_x",
    damping=tyre_longitudinal_damping,
    passive=True,
    shows_in=("launch", "hard_braking"),
    params=(
        Param("slip_extremum", 0.2, "1", "tyre.slip_extremum", (0.01, 1.0),
              "slip of most grip", LogNormal(0.2, 0.3)),
        Param("force_extremum", 1.0, "1", "tyre.force_extremum", (0.05, 3.0),
              "most force over load", LogNormal(0.9, 0.3)),
        Param("slip_asymptote", 0.5, "1", "tyre.slip_asymptote", (0.02, 3.0),
              "slip from where the tyre only slides", LogNormal(0.5, 0.3)),
        Param("force_asymptote", 0.75, "1", "tyre.force_asymptote", (0.02, 3.0),
              "sliding force over load", LogNormal(0.7, 0.3)),
        Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
              "floor of the slip's denominator", fit=False),
    ),
)  # fmt: skip
