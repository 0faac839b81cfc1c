"""Tyre windup: force along needs a rolled length to build up, and at rest it holds.

    length * d(spin_lag)/dt + |v_long| * spin_lag = wheel_radius * omega - v_long
    spin_lag_speed = length / max(dt, rubber)

The same as tyre_relaxation, along the wheel, rubber too. With both, a car whose motors hold
stands on a slope. Quasi-static tyres let it creep: on a slope of 0.05 Nigel by 0.7 mm a second,
F1TENTH by 2, in proportion to the slope.
Holds: lengths above 1 mm at 1 ms substeps.   Shows in: launch, standing on a slope.
Source: Pacejka, Tire and Vehicle Dynamics, single contact point transient model.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_LENGTH = Param("length", 0.0, "m", "tyre_windup.length_m", (0.0, 2.0),
                "rolled for 63 % of the force along", LogNormal(0.02, 1.0),
                report="length_m")  # fmt: skip
_LOW_SPEED = Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
                   "floor of the slip's denominator", fit=False)  # fmt: skip
_RUBBER = 0.01  # s, how long rubber at rest resists; ours, it ends the swing in some tenths


@kernel_function
def tyre_windup(
    omega: float, v_long: float, wheel_radius: float, spin_lag: float, dt: float, length: float,
    slip_extremum: float, low_speed: float,
) -> float:  # fmt: skip
    """Spin slip that the contact patch carries, + driving; 0 without a length."""
    slide = wheel_radius * omega - v_long
    most = max(slip_extremum, abs(slide) / max(abs(v_long), low_speed))
    speed = max(abs(v_long) + length / dt, low_speed)
    carried = (slide + length / dt * spin_lag) / speed
    return min(max(carried, -most), most) if length > 0.0 else 0.0


@kernel_function
def tyre_windup_speed(v_long: float, dt: float, length: float, low_speed: float) -> float:
    """How much of the carried slip the tyre feels beside the new one [m/s]."""
    rubber = _RUBBER * (1.0 - abs(v_long) * (0.5 / low_speed))
    return length / max(dt, rubber)


TERM = Term(
    tyre_windup, per=Per.WHEEL, sets="spin_lag", keeps=0.0, neutral={"length": 0.0},
    shows_in=("launch", "stand_on_slope"),
    params=(
        _LENGTH,
        Param("slip_extremum", 0.2, "1", "tyre.slip_extremum", (0.01, 1.0),
              "slip of most grip", LogNormal(0.2, 0.3)),
        _LOW_SPEED,
    ),
    also=(Term(tyre_windup_speed, per=Per.WHEEL, sets="spin_lag_speed",
               neutral={"length": 0.0}, params=(_LENGTH, _LOW_SPEED),
               shows_in=("launch",)),),
)  # fmt: skip
