"""Pose scale: the tracking system shows distances too long or too short.

    measured = scale * true    (x and y, from the world's origin)    [m]

Holds: one scale both ways.   Shows in: any drive, against encoders or a measured distance.
Source: ground-plane calibration; a camera believed at the wrong height does this.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def pose_scale(value: Floats, scale: float) -> Floats:
    """Coordinate that the recording carries [m]."""
    return scale * value


SENSOR_FAULT = SensorFault(
    functions={"pose.x": pose_scale, "pose.y": pose_scale},
    neutral={"scale": 1.0},
    shows_in=("straight", "circle"),
    params=(
        Param("scale", 1.0, "1", "measure.pose_scale", (0.2, 5.0),
              "measured over true distance", Normal(1.0, 0.03)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("position",), starts=((1.02,), (0.98,)), steps=(0.005,),
        shared="camera", needs_distance=True,
        sentence="The camera shows {scale_cm} for every 100 cm on the floor.",
        experiments=("rotated",),
        advice="Measure two marks on the floor with a tape and calibrate the tracking again.",
        line=Line("distance from the origin", "m", "position error", "m",
                  lambda x, v: (v - 1.0) * x),
    ),
)  # fmt: skip
