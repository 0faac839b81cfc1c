"""Throttle curve: small throttles give less, or more, than their share of the full one.

    throttle_curved = throttle_eased * (1 - curvature + curvature * |throttle_eased|)

0 is a straight line, 1 a parabola; full throttle stays full. A power law of exponent 1.33,
as others write it, looks like a curvature of 0.45 between throttles of 0.2 and 0.6.
Holds: the same both ways.   Shows in: steady speed at several throttles.
Source: CPM Lab's vehicle model has sign(f) |f|^p with p = 1.3 to 1.6 for it; the parabola is ours.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_curve(throttle_eased: float, curvature: float) -> float:
    """Throttle after the controller's curve, + forward; exactly the throttle without curvature."""
    return throttle_eased * (1.0 - curvature + curvature * abs(throttle_eased))


TERM = Term(
    drive_curve,
    per=Per.BODY,
    sets="throttle_curved",
    neutral={"curvature": 0.0},
    shows_in=("steady_speed", "throttle_ramp"),
    params=(
        Param("curvature", 0.0, "1", "drive.curvature", (-1.0, 1.0),
              "share of the parabola", Normal(0.0, 0.3)),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.2,), (-0.2,)), steps=(0.03,),
        rare=10.0,
        sentence="Throttle and drive are not proportional: curvature {curvature}.",
        advice="Note the steady speed at five throttles; look for an exponential setting in the "
               "radio or the controller.",
    ),
)  # fmt: skip
