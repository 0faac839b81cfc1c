"""Tyre relaxation: side force needs a rolled length to build up, and at rest it holds.

    length * d(side_lag)/dt + |v_long| * side_lag = v_lat
    side_lag_speed = length / max(dt / 2, rubber)

side_lag is the slip that the contact patch carries as a substep begins, v_lat the sliding until
then: before the wheel turned on from slope_before. The tyre feels the mean over the substep. At
rest nothing is forgotten: the patch is a spring, so a car on a side slope stands where a
quasi-static tyre creeps. A patch that slides carries no more than the slip of the slide, at rest
that of most grip. rubber = 10 ms at rest, 0 from twice low_speed on, damps that spring.
Holds: lengths above 1 mm at 1 ms substeps.   Shows in: steering steps at speed, standing.
Source: Pacejka, Tire and Vehicle Dynamics, single contact point transient model.
"""

import math

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term

_LENGTH = Param("length", 0.0, "m", "tyre_relaxation.length_m", (0.0, 2.0),
                "rolled for 63 % of the side force", LogNormal(0.05, 1.0),
                report="length_m")  # fmt: skip
_LOW_SPEED = Param("low_speed", 0.05, "m/s", "tyre.low_speed_m_s", (0.01, 1.0),
                   "floor of the slip's denominator", fit=False)  # fmt: skip
_RUBBER = 0.01  # s, how long rubber at rest resists; ours, it ends the swing in some tenths


@kernel_function
def tyre_relaxation(
    v_long: float, v_lat: float, side_lag: float, dt: float, wheel_slope: float,
    slope_before: float, yaw_rate: float, length: float, slip_extremum: float, low_speed: float,
) -> float:  # fmt: skip
    """Side slip that the contact patch carries as the substep begins, + sliding left."""
    sine, cosine = wheel_slope - slope_before, 1.0 + wheel_slope * slope_before
    turned = (cosine * v_lat + sine * v_long) / math.sqrt(cosine * cosine + sine * sine)
    slid = turned + v_long * yaw_rate * dt
    most = max(slip_extremum, abs(slid) / max(abs(v_long), low_speed))
    stays = max(length / dt - 0.5 * abs(v_long), 0.0)
    carried = (slid + stays * side_lag) / max(abs(v_long) + stays, low_speed)
    return min(max(carried, -most), most) if length > 0.0 else 0.0


@kernel_function
def tyre_relaxation_speed(v_long: float, dt: float, length: float, low_speed: float) -> float:
    """How much of the carried slip the tyre feels beside the new one [m/s]."""
    rubber = _RUBBER * (1.0 - abs(v_long) * (0.5 / low_speed))
    return length / max(0.5 * dt, rubber)


TERM = Term(
    tyre_relaxation, per=Per.WHEEL, sets="side_lag", keeps=0.0, neutral={"length": 0.0},
    shows_in=("steering_step", "stand_on_slope"),
    params=(
        _LENGTH,
        Param("slip_extremum", 0.2, "1", "tyre.lateral_slip_extremum", (0.01, 1.0),
              "slip of most grip", LogNormal(0.2, 0.3)),
        _LOW_SPEED,
    ),
    also=(Term(tyre_relaxation_speed, per=Per.WHEEL, sets="side_lag_speed",
               neutral={"length": 0.0}, params=(_LENGTH, _LOW_SPEED),
               shows_in=("steering_step",)),),
    identification=Identification(
        equation="tyre", depends_on=("slip history",), starts=((0.05,), (0.15,), (0.4,)),
        steps=(0.02,), needs_m_s2=0.5, parameters=("length_m",),
        sentence="The tyres build up side force only after rolling {length_m}.",
        experiments=("other_wheels",),
        advice="Nothing to repair: the tyre needs some way to build up its side force. Keep it in "
               "the simulator.",
    ),
)  # fmt: skip
