"""Pose heading: the tracked marker is glued on at an angle.

    yaw_measured = yaw + offset    [rad]

The sum is not wrapped.
Holds: rigid marker.   Shows in: straight drives, where the car seems to drive slantwise.
Source: rigid-body geometry; + where the marker is turned counter-clockwise on the car.
"""

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def pose_heading(value: Floats, offset: float) -> Floats:
    """Heading that the recording carries [rad]."""
    return value + offset


SENSOR_FAULT = SensorFault(
    functions={"pose.yaw": pose_heading},
    neutral={"offset": 0.0},
    shows_in=("straight",),
    params=(
        Param("offset", 0.0, "rad", "measure.pose_heading_rad", (-3.15, 3.15),
              "marker's turn on the car, + left", Normal(0.0, 0.03), report="offset_rad"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("constant",), starts=((0.02,), (-0.02,)), steps=(0.005,),
        shared="tags",
        sentence="The camera's heading is off by {offset_rad}.",
        advice="Put the marker on straight, or write its angle down.",
    ),
)  # fmt: skip
