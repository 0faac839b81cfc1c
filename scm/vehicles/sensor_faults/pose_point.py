"""Pose point: the tracked marker is not where it is believed to be on the car.

    x_measured = x + cos(yaw) * ahead - sin(yaw) * aside    [m]
    y_measured = y + sin(yaw) * ahead + cos(yaw) * aside    [m]

Holds: rigid marker, level car.   Shows in: turning on the spot, tight circles both ways.
Source: rigid-body geometry; (ahead, aside) is the marker's true place, body frame, from the
believed one: + ahead of it, + to its left.
"""

import numpy as np

from scm.arrays import Floats
from scm.vehicles.identification import Identification
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def pose_point(pose_x: Floats, pose_yaw: Floats, ahead: float, aside: float) -> Floats:
    """World x that the recording carries [m]."""
    return pose_x + (np.cos(pose_yaw) * ahead - np.sin(pose_yaw) * aside)


def pose_point_y(pose_y: Floats, pose_yaw: Floats, ahead: float, aside: float) -> Floats:
    """World y that the recording carries [m]."""
    return pose_y + (np.sin(pose_yaw) * ahead + np.cos(pose_yaw) * aside)


SENSOR_FAULT = SensorFault(
    functions={"pose.x": pose_point, "pose.y": pose_point_y},
    neutral={"ahead": 0.0, "aside": 0.0},
    shows_in=("tight_circle", "figure_eight"),
    params=(
        Param("ahead", 0.0, "m", "measure.pose_point_x_m", (-1.0, 1.0),
              "marker ahead of where it is believed", Normal(0.0, 0.03), report="x_m"),
        Param("aside", 0.0, "m", "measure.pose_point_y_m", (-1.0, 1.0),
              "marker left of where it is believed", Normal(0.0, 0.02), report="y_m"),
    ),
    identification=Identification(
        equation="sensor", depends_on=("yaw rate",),
        starts=((0.03, 0.0), (-0.03, 0.0), (0.0, 0.02)), steps=(0.005, 0.005), shared="tags",
        sentence="The tracked point lies {x_m} ahead and {y_m} left of where it is said to be.",
        advice="Measure where the marker sits from the rear axle's centre, and write it into the "
               "recording's `point`.",
    ),
)  # fmt: skip
