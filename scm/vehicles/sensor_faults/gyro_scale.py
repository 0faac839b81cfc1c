"""Gyro scale: the gyro shows every turn so many times faster.

    gyro_z_measured = scale * gyro_z    [rad/s]

Holds: inside the gyro's range.   Shows in: full turns, against the pose's heading.
Source: IEEE Std 952, scale factor error.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def gyro_scale(value: Floats, scale: float) -> Floats:
    """Yaw rate that the recording carries [rad/s]."""
    return scale * value


SENSOR_FAULT = SensorFault(
    functions={"imu.gyro_z": gyro_scale},
    neutral={"scale": 1.0},
    shows_in=("circle",),
    params=(
        Param("scale", 1.0, "1", "measure.gyro_scale", (0.2, 5.0),
              "measured over true rate", Normal(1.0, 0.03)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("yaw rate",), starts=((1.03,), (0.97,)), steps=(0.01,),
        sentence="The gyro shows {scale} of the true yaw rate.",
        advice="Turn the car by ten full turns by hand and compare with the gyro.",
        line=Line("yaw rate", "rad/s", "gyro error", "rad/s", lambda x, v: (v - 1.0) * x),
    ),
)  # fmt: skip
