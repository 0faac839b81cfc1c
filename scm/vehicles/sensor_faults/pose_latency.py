"""Pose latency: a pose is stamped when it arrives, so it shows where the car was before.

    t_measured = t + delay    [s]

A pose stamped t shows the car at t - delay. From stamps alone it is `clock_offset`'s twin, but
is never negative.
Holds: constant delay.   Shows in: steering steps and launches, against encoders and gyro.
Source: textbook dead time; camera exposure, detection and radio together.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.sensor_fault import SensorFault


def pose_latency(t: Floats, delay: float) -> Floats:
    """Stamp that the recording carries [s]."""
    return t + delay


SENSOR_FAULT = SensorFault(
    functions={"pose.*": pose_latency},
    stamps=True,
    neutral={"delay": 0.0},
    shows_in=("steering_step", "throttle_step"),
    params=(
        Param("delay", 0.0, "s", "measure.pose_delay_s", (0.0, 1.0),
              "from the moment shown to the stamp", LogNormal(0.05, 0.8), report="delay_s"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("speed",), starts=((0.02,), (0.04,), (0.08,), (0.16,)),
        steps=(0.01,), shared="camera",
        sentence="The camera's poses are {delay_s} old when they are stamped.",
        advice="Stamp poses when the picture is taken, not when they arrive.",
    ),
)  # fmt: skip
