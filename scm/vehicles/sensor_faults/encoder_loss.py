"""Encoder loss: a share of the encoders' counts never arrives.

    counts_measured = (1 - fraction) * counts

Holds: losses spread evenly, both wheels alike.   Shows in: any drive, encoders against pose.
Source: dirty disc, missed interrupts; the definition is ours. On encoders alone it looks like
`wheel_radius`; wheel speeds from elsewhere, or the drive's steady speed, tell.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.sensor_fault import SensorFault


def encoder_loss(value: Floats, fraction: float) -> Floats:
    """Counts that the recording carries; not rounded, so that small losses can be fitted."""
    return (1.0 - fraction) * value


SENSOR_FAULT = SensorFault(
    functions={"encoder.*": encoder_loss},
    neutral={"fraction": 0.0},
    shows_in=("straight",),
    params=(
        Param("fraction", 0.0, "1", "measure.encoder_loss", (0.0, 0.95),
              "share of the counts that is lost", LogNormal(0.03, 1.0)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("wheel",), starts=((0.03,), (0.1,)), steps=(0.01,),
        sentence="The encoders lose {fraction} of their counts.",
        advice="Clean the encoder's disc, check its plug, and compare counts with ten turns of "
               "the wheel by hand.",
        line=Line("speed", "m/s", "wheel speed error", "m/s", lambda x, v: -v * x),
    ),
)  # fmt: skip
