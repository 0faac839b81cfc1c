"""Gyro bias: the gyro shows a turn when there is none.

    gyro_z_measured = gyro_z + bias    [rad/s]

Holds: minutes at steady temperature.   Shows in: standing still, straight drives.
Source: IEEE Std 952, gyro error model; + shows a turn to the left.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def gyro_bias(value: Floats, bias: float) -> Floats:
    """Yaw rate that the recording carries [rad/s]."""
    return value + bias


SENSOR_FAULT = SensorFault(
    functions={"imu.gyro_z": gyro_bias},
    neutral={"bias": 0.0},
    shows_in=("standing", "straight"),
    params=(
        Param("bias", 0.0, "rad/s", "measure.gyro_bias_rad_s", (-1.0, 1.0),
              "added, + left", Normal(0.0, 0.02), report="bias_rad_s"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("constant",), starts=((0.02,), (-0.02,)), steps=(0.005,),
        sentence="The gyro reads {bias_rad_s} too much.",
        advice="Keep the car still for five seconds before each drive and subtract what the gyro "
               "shows.",
        line=Line("yaw rate", "rad/s", "gyro error", "rad/s", lambda x, v: v + 0.0 * x),
    ),
)  # fmt: skip
