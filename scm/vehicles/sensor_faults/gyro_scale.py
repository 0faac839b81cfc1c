"""Gyro scale: the gyro shows every turn so many times faster.

    gyro_z_measured = scale * gyro_z    [rad/s]

Holds: inside the gyro's range.   Shows in: full turns, against the pose's heading.
Source: IEEE Std 952, scale factor error.
"""

from scm.arrays import Floats
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
)  # fmt: skip
