"""Accelerometer bias: it shows a push when there is none.

    accel_x_measured = accel_x + along,  accel_y_measured = accel_y + across    [m/s^2]

Holds: steady temperature, level mount (a lean of 1 degree alone gives 0.17 m/s^2).
Shows in: standing still.   Source: IEEE Std 1293, accelerometer model; + forward, + left.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def accel_bias(value: Floats, along: float) -> Floats:
    """Forward acceleration that the recording carries [m/s^2]."""
    return value + along


def accel_bias_y(value: Floats, across: float) -> Floats:
    """Leftward acceleration that the recording carries [m/s^2]."""
    return value + across


SENSOR_FAULT = SensorFault(
    functions={"imu.accel_x": accel_bias, "imu.accel_y": accel_bias_y},
    neutral={"along": 0.0, "across": 0.0},
    shows_in=("standing",),
    params=(
        Param("along", 0.0, "m/s^2", "measure.accel_bias_x_m_s2", (-5.0, 5.0),
              "added, + forward", Normal(0.0, 0.1), report="x_mps2"),
        Param("across", 0.0, "m/s^2", "measure.accel_bias_y_m_s2", (-5.0, 5.0),
              "added, + left", Normal(0.0, 0.1), report="y_mps2"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("constant",), starts=((0.1, 0.0), (0.0, 0.1)),
        steps=(0.02, 0.02),
        sentence="The accelerometer reads {x_mps2} and {y_mps2} too much along and across.",
        advice="Calibrate the IMU at rest on a level floor before each drive.",
    ),
)  # fmt: skip
