"""Throttle dead-band: small commands do nothing, larger ones lose as much.

    throttle_live = throttle_limited - clip(throttle_limited, -threshold, threshold)

Holds: the same both ways.   Shows in: throttle ramps, crawling.
Source: textbook dead zone; the real Nigel needs about 0.2 throttle to move.
"""

from scm.vehicles.identification import Identification
from scm.vehicles.jit import kernel_function
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_deadband(throttle_limited: float, threshold: float) -> float:
    """Throttle that is left, + forward."""
    return throttle_limited - min(max(throttle_limited, -threshold), threshold)


TERM = Term(
    drive_deadband,
    per=Per.BODY,
    sets="throttle_live",
    neutral={"threshold": 0.0},
    shows_in=("throttle_ramp", "crawl"),
    params=(
        Param("threshold", 0.0, "1", "drive.deadband", (0.0, 0.6),
              "throttle below which nothing happens", LogNormal(0.05, 0.8)),
    ),
    identification=Identification(
        equation="drive", depends_on=("throttle",), starts=((0.015,), (0.04,), (0.1,)),
        steps=(0.01,),
        sentence="Throttle below {threshold} does nothing.",
        advice="Raise the throttle slowly from zero and note where the car starts. Calibrate the "
               "controller's neutral.",
    ),
)  # fmt: skip
