"""Combined slip: forces along and across share one friction, so hard brakes hold less.

    p = spin slip / slip_extremum,  q = side slip / side_slip_extremum,  r = sqrt(p^2 + q^2)
    tyre_x += load * grip * p / r * F(r),  tyre_y += -load * grip * q / r * F_side(r)    [N]

F and F_side are the paper's two cubics; with one slip alone they are tyre_longitudinal and
tyre_lateral exactly. List this one instead of those two.
Holds: dry floor; no rise of grip per load.   Shows in: braking in a turn, power out of a corner.
Source: Pacejka, Tire and Vehicle Dynamics, combined slip by normalised slips.
"""

import math

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term
from scm.vehicles.tyre_curve import curve_over_slip

_BOTH = (
    Param("slip_extremum", 0.2, "1", "tyre.slip_extremum", (0.01, 1.0),
          "spin slip of most grip", LogNormal(0.2, 0.3)),
    Param("side_slip_extremum", 0.2, "1", "tyre.lateral_slip_extremum", (0.01, 1.0),
          "side slip of most grip", LogNormal(0.2, 0.3)),
    Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
          "floor of the slip's denominator", fit=False),
)  # fmt: skip
_ALONG = (
    Param("force_extremum", 1.0, "1", "tyre.force_extremum", (0.05, 3.0),
          "most force over load", LogNormal(0.9, 0.3)),
    Param("slip_asymptote", 0.5, "1", "tyre.slip_asymptote", (0.02, 3.0),
          "slip from where the tyre only slides", LogNormal(0.5, 0.3)),
    Param("force_asymptote", 0.75, "1", "tyre.force_asymptote", (0.02, 3.0),
          "sliding force over load", LogNormal(0.7, 0.3)),
)  # fmt: skip
_ACROSS = (
    Param("force_extremum", 1.0, "1", "tyre.lateral_force_extremum", (0.05, 3.0),
          "most force over load", LogNormal(0.9, 0.3)),
    Param("slip_asymptote", 0.5, "1", "tyre.lateral_slip_asymptote", (0.02, 3.0),
          "slip from where the tyre only slides", LogNormal(0.5, 0.3)),
    Param("force_asymptote", 0.75, "1", "tyre.lateral_force_asymptote", (0.02, 3.0),
          "sliding force over load", LogNormal(0.7, 0.3)),
)  # fmt: skip


@kernel_function
def both_slips(
    slide: float, v_long: float, v_lat: float, slip_scale: float, side_lag: float,
    side_lag_speed: float, spin_lag_speed: float, low_speed: float, slip_extremum: float,
    side_slip_extremum: float,
) -> float:  # fmt: skip
    """How far both slips together are toward most grip, 1 there."""
    p = slide / max(abs(v_long) + spin_lag_speed, low_speed) / slip_extremum
    side = (v_lat + side_lag_speed * side_lag) / max(abs(v_long) + side_lag_speed, low_speed)
    q = slip_scale * side / side_slip_extremum
    return math.sqrt(p * p + q * q)


@kernel_function
def tyre_combined_damping(
    omega: float, v_long: float, v_lat: float, grip_load: float, grip: float, wheel_radius: float,
    slip_scale: float, side_lag: float, side_lag_speed: float, spin_lag: float,
    spin_lag_speed: float, low_speed: float, slip_extremum: float, side_slip_extremum: float,
    force_extremum: float, slip_asymptote: float, force_asymptote: float,
) -> float:  # fmt: skip
    """Force per slip speed, the secant [N*s/m]."""
    slide = wheel_radius * omega - v_long + spin_lag_speed * spin_lag
    felt = slip_extremum * both_slips(
        slide, v_long, v_lat, slip_scale, side_lag, side_lag_speed, spin_lag_speed, low_speed,
        slip_extremum, side_slip_extremum,
    )  # fmt: skip
    curve = curve_over_slip(felt, slip_extremum, force_extremum, slip_asymptote, force_asymptote)
    return grip_load * grip / max(abs(v_long) + spin_lag_speed, low_speed) * curve


@kernel_function
def tyre_combined(
    omega: float, v_long: float, v_lat: float, grip_load: float, grip: float, wheel_radius: float,
    slip_scale: float, side_lag: float, side_lag_speed: float, spin_lag: float,
    spin_lag_speed: float, low_speed: float, slip_extremum: float, side_slip_extremum: float,
    force_extremum: float, slip_asymptote: float, force_asymptote: float,
) -> float:  # fmt: skip
    """Force along the wheel, + forward [N]."""
    return (wheel_radius * omega - v_long + spin_lag_speed * spin_lag) * tyre_combined_damping(
        omega, v_long, v_lat, grip_load, grip, wheel_radius, slip_scale, side_lag, side_lag_speed,
        spin_lag, spin_lag_speed, low_speed, slip_extremum, side_slip_extremum, force_extremum,
        slip_asymptote, force_asymptote,
    )  # fmt: skip


@kernel_function
def tyre_combined_across_damping(
    omega: float, v_long: float, v_lat: float, grip_load: float, grip: float, wheel_radius: float,
    slip_scale: float, side_lag: float, side_lag_speed: float, spin_lag: float,
    spin_lag_speed: float, low_speed: float, slip_extremum: float, side_slip_extremum: float,
    force_extremum: float, slip_asymptote: float, force_asymptote: float,
) -> float:  # fmt: skip
    """Force per side speed, the secant [N*s/m]."""
    slide = wheel_radius * omega - v_long + spin_lag_speed * spin_lag
    peak = side_slip_extremum
    felt = peak * both_slips(
        slide, v_long, v_lat, slip_scale, side_lag, side_lag_speed, spin_lag_speed, low_speed,
        slip_extremum, side_slip_extremum,
    )  # fmt: skip
    curve = curve_over_slip(felt, peak, force_extremum, slip_asymptote, force_asymptote)
    return grip_load * grip * slip_scale / max(abs(v_long) + side_lag_speed, low_speed) * curve


@kernel_function
def tyre_combined_across(
    omega: float, v_long: float, v_lat: float, grip_load: float, grip: float, wheel_radius: float,
    slip_scale: float, side_lag: float, side_lag_speed: float, spin_lag: float,
    spin_lag_speed: float, low_speed: float, slip_extremum: float, side_slip_extremum: float,
    force_extremum: float, slip_asymptote: float, force_asymptote: float,
) -> float:  # fmt: skip
    """Force across the wheel, + to its left [N]."""
    return -(v_lat + side_lag_speed * side_lag) * tyre_combined_across_damping(
        omega, v_long, v_lat, grip_load, grip, wheel_radius, slip_scale, side_lag, side_lag_speed,
        spin_lag, spin_lag_speed, low_speed, slip_extremum, side_slip_extremum, force_extremum,
        slip_asymptote, force_asymptote,
    )  # fmt: skip


TERM = Term(
    tyre_combined, per=Per.WHEEL, adds="tyre_x", damping=tyre_combined_damping, passive=True,
    params=(*_BOTH, *_ALONG), shows_in=("brake_in_turn", "launch"),
    also=(Term(tyre_combined_across, per=Per.WHEEL, adds="tyre_y",
               damping=tyre_combined_across_damping, passive=True, params=(*_BOTH, *_ACROSS),
               shows_in=("brake_in_turn", "fast_circle")),),
)  # fmt: skip
