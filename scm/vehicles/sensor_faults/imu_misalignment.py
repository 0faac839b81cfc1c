"""IMU misalignment: the sensor is turned on its mount, so along and across mix.

    accel_x_measured =  cos(angle) * accel_x + sin(angle) * accel_y    [m/s^2]
    accel_y_measured = -sin(angle) * accel_x + cos(angle) * accel_y    [m/s^2]

Holds: turned about z alone, which the gyro about z does not feel.   Shows in: braking, circles.
Source: rotation of axes; + where the sensor is turned counter-clockwise (left) on the car.
"""

import math

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def imu_misalignment(imu_accel_x: Floats, imu_accel_y: Floats, angle: float) -> Floats:
    """Acceleration along the sensor's x [m/s^2]."""
    return math.cos(angle) * imu_accel_x + math.sin(angle) * imu_accel_y


def imu_misalignment_y(imu_accel_x: Floats, imu_accel_y: Floats, angle: float) -> Floats:
    """Acceleration along the sensor's y [m/s^2]."""
    return math.cos(angle) * imu_accel_y - math.sin(angle) * imu_accel_x


SENSOR_FAULT = SensorFault(
    functions={"imu.accel_x": imu_misalignment, "imu.accel_y": imu_misalignment_y},
    neutral={"angle": 0.0},
    shows_in=("hard_braking", "circle"),
    params=(
        Param("angle", 0.0, "rad", "measure.imu_angle_rad", (-3.15, 3.15),
              "sensor's turn on the car, + left", Normal(0.0, 0.05), report="angle_rad"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("acceleration",), starts=((0.05,), (-0.05,)), steps=(0.01,),
        sentence="The IMU is turned by {angle_rad} in the car.",
        advice="Mount the IMU straight, or write its angle into the car file.",
    ),
)  # fmt: skip
