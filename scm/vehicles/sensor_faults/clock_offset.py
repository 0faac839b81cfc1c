"""Clock offset: the clock of the poses is ahead of the car's.

    t_measured = t + offset    [s]

Holds: clocks of equal rate.   Shows in: steering steps and launches, against encoders and gyro.
Source: unsynchronised computers; + where the poses' clock is ahead. A positive offset looks like
`pose_latency`; only a negative one can be told for certain. Other channels may be named.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def clock_offset(t: Floats, offset: float) -> Floats:
    """Stamp that the recording carries [s]."""
    return t + offset


SENSOR_FAULT = SensorFault(
    functions={"*": clock_offset},
    stamps=True,
    neutral={"offset": 0.0},
    shows_in=("steering_step", "throttle_step"),
    acts_on=("pose.*",),
    params=(
        Param("offset", 0.0, "s", "measure.clock_offset_s", (-5.0, 5.0),
              "ahead of the car's clock", Normal(0.0, 0.1), report="offset_s"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("speed",), starts=((-0.02,), (-0.04,), (-0.1,)),
        steps=(0.01,), bounds={"offset_s": (-0.3, 0.0)}, shared="camera",
        sentence="The poses' clock is {offset_s} against the car's: commands and sensors are "
                 "stamped late.",
        advice="Let both computers take their time from one clock (NTP or PTP), and record a "
               "sharp start to check it.",
    ),
)  # fmt: skip
