r"""Camera lens: an overhead camera's scale changes from the middle of the floor to its rim.

    x_measured = x * (1 + s),  y_measured = y * (1 + s),
    s = per_x * |x| + per_y * |y| + per_square * (x^2 + y^2)    [1]

A lens bends rays by a share of the image that grows with the square of the distance from its
middle, to first order: per_square in 1/m^2, - for a barrel, + for a pincushion. per_x and per_y in
1/m are for what a calibration with marks in the middle alone leaves along one side of the floor.
Calibration with marks over the whole floor takes all of it away.
Holds: |s| well below 1; the origin of the floor is the middle of the picture; heading as the marker
itself shows it.
Shows in: equal circles at the floor's ends.
Source: radial distortion (Brown, Decentering Distortion of Lenses, 1966), first term.
"""

import numpy as np

from scm.arrays import Floats
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def _scale(x: Floats, y: Floats, per_x: float, per_y: float, per_square: float) -> Floats:
    return 1.0 + per_x * np.abs(x) + per_y * np.abs(y) + per_square * (x * x + y * y)


def camera_lens(
    pose_x: Floats, pose_y: Floats, per_x: float, per_y: float, per_square: float
) -> Floats:
    """World x that the recording carries [m]."""
    return pose_x * _scale(pose_x, pose_y, per_x, per_y, per_square)


def camera_lens_y(
    pose_x: Floats, pose_y: Floats, per_x: float, per_y: float, per_square: float
) -> Floats:
    """World y that the recording carries [m]."""
    return pose_y * _scale(pose_x, pose_y, per_x, per_y, per_square)


SENSOR_FAULT = SensorFault(
    functions={"pose.x": camera_lens, "pose.y": camera_lens_y},
    neutral={"per_x": 0.0, "per_y": 0.0, "per_square": 0.0},
    shows_in=("circles_at_the_ends",),
    params=(
        Param("per_x", 0.0, "1/m", "measure.camera_lens_x_per_m", (-0.3, 0.3),
              "+ where the floor at either end of x looks too large", Normal(0.0, 0.03)),
        Param("per_y", 0.0, "1/m", "measure.camera_lens_y_per_m", (-0.3, 0.3),
              "+ where the floor at either end of y looks too large", Normal(0.0, 0.03)),
        Param("per_square", 0.0, "1/m^2", "measure.camera_lens_per_m2", (-0.3, 0.3),
              "+ where the floor's rim looks too large", Normal(0.0, 0.03)),
    ),
)  # fmt: skip
