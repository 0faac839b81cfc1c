r"""Camera tilt: an overhead camera believed to look straight down leans, so the far side shrinks.

    x_measured = x / d,  y_measured = y / d,  d = 1 + tilt_x * x + tilt_y * y    [m]

A camera at height h whose axis leans by an angle a toward +x sees the floor point (x, y) at depth
h cos a + x sin a. Its image, taken for a vertical camera's and shifted so that the origin stays at
the origin, is x / cos^2 a / (1 + x tan a / h), y / cos a / (1 + x tan a / h). The cosines differ
from 1 by a^2 and vanish in `pose_scale`; what is left has tilt_x = tan a / h in 1/m, + where the
axis leans toward +x and the floor there looks too small. Likewise y. A camera that stands askew is
straight again when its own tilt is calibrated; a floor that slopes under a true camera looks alike.
Holds: d > 0.2; the origin's marker is where it should be; heading as the marker itself shows it.
Shows in: equal circles at the floor's ends.
Source: pinhole projection (Hartley and Zisserman, Multiple View Geometry, chapter 2), derived here.
"""

import numpy as np

from scm.arrays import Floats
from scm.vehicles.identification import Identification, Line
from scm.vehicles.param import Normal, Param
from scm.vehicles.sensor_fault import SensorFault


def _depth(x: Floats, y: Floats, tilt_x: float, tilt_y: float) -> Floats:
    return np.maximum(1.0 + tilt_x * x + tilt_y * y, 0.2)


def camera_tilt(pose_x: Floats, pose_y: Floats, tilt_x: float, tilt_y: float) -> Floats:
    """World x that the recording carries [m]."""
    return pose_x / _depth(pose_x, pose_y, tilt_x, tilt_y)


def camera_tilt_y(pose_x: Floats, pose_y: Floats, tilt_x: float, tilt_y: float) -> Floats:
    """World y that the recording carries [m]."""
    return pose_y / _depth(pose_x, pose_y, tilt_x, tilt_y)


SENSOR_FAULT = SensorFault(
    functions={"pose.x": camera_tilt, "pose.y": camera_tilt_y},
    neutral={"tilt_x": 0.0, "tilt_y": 0.0},
    shows_in=("circles_at_the_ends",),
    params=(
        Param("tilt_x", 0.0, "1/m", "measure.camera_tilt_x_per_m", (-0.3, 0.3),
              "+ where the floor at +x looks too small", Normal(0.0, 0.03)),
        Param("tilt_y", 0.0, "1/m", "measure.camera_tilt_y_per_m", (-0.3, 0.3),
              "+ where the floor at +y looks too small", Normal(0.0, 0.03)),
    ),
    identification=Identification(
        equation="sensor", depends_on=("position",),
        starts=((0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.0, -0.03)), steps=(0.005, 0.005),
        shared="camera",
        sentence="The camera looks askew: its scale changes by {tilt_x} along x and {tilt_y} "
                 "along y.",
        experiments=("rotated",),
        advice="Calibrate the overhead camera again, with marks over the whole floor.",
        line=Line("position", "m", "scale error", "1", lambda x, v: 1.0 / (1.0 + v * x) - 1.0),
    ),
)  # fmt: skip
