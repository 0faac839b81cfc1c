"""From the corners of a roof tag to the pose of its car, with covariance.

The roof's height is known, so nothing has to be guessed from the tag's few pixels in depth: the
rays of the four corners are cut with the level plane at that height, and a square of the tag's size
is laid onto the four points by least squares. The rear axle is then the tag's offset away, behind
it along the car's own axis.

    yaw = atan2(sum c x q, sum c . q)      c: corners of the tag, q: points on the plane, middle off
    axle = middle - R(yaw) offset

The covariance is carried through by differences: doubt of the corners, doubt of the camera's place
(shared by all cars of a frame), and the lean of the body, which moves the roof but cannot be seen.
"""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.eye.anchor import STEPS, Anchor
from scm.eye.camera import CameraModel
from scm.geometry import Pose2, wrap_angle
from scm.scenery.bodies import CarBody
from scm.scenery.tags import tag_corners

LEAN_RAD = 0.003
"""Standard deviation of roll and of pitch that a scaled car is trusted to stay within."""
PROBE_PX = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """Pose of the rear axle in the map frame, and covariance over x, y, yaw, (3, 3)."""

    pose: Pose2
    covariance: Floats


def car_pose(anchor: Anchor, body: CarBody, corners: Floats) -> PoseEstimate:
    """Return where the car is whose roof tag has these corners, (4, 2) [px]."""
    model = anchor.model
    ideal = model.undistort(corners)[None]
    x, y, yaw = (float(value) for value in _fit(model, body, ideal)[0])
    by_corner = _by_corner(model, body, corners)
    by_camera = _by_camera(anchor, body, ideal)
    covariance = anchor.corner_std_px**2 * by_corner @ by_corner.T
    covariance += by_camera @ anchor.covariance @ by_camera.T
    covariance[[0, 1], [0, 1]] += (body.tag_position[2] * LEAN_RAD) ** 2
    return PoseEstimate(Pose2(x, y, wrap_angle(yaw)), (covariance + covariance.T) / 2.0)


def _fit(model: CameraModel, body: CarBody, ideal: Floats) -> Floats:
    """Return x, y, yaw of the rear axle for sets of undistorted corners, (n, 4, 2) to (n, 3)."""
    x, y, height = body.tag_position
    points = model.on_plane(ideal, height)
    middle = points.mean(axis=1)
    spread = points - middle[:, None]
    square = tag_corners(body.tag_size)
    turned = square[:, 0] * spread[..., 1] - square[:, 1] * spread[..., 0]
    yaw = np.arctan2(turned.sum(axis=1), (square * spread).sum(axis=(1, 2)))
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack((middle[:, 0] - c * x + s * y, middle[:, 1] - s * x - c * y, yaw))


def _by_corner(model: CameraModel, body: CarBody, corners: Floats) -> Floats:
    """Return the change of the pose by each corner coordinate, (3, 8)."""
    probes = (np.eye(8) * PROBE_PX).reshape(8, 4, 2)
    ideal = model.undistort(np.concatenate((corners + probes, corners - probes)))
    both = _fit(model, body, ideal)
    return _difference(both[:8], both[8:]).T / (2.0 * PROBE_PX)


def _by_camera(anchor: Anchor, body: CarBody, ideal: Floats) -> Floats:
    """Return the change of the pose by each of the camera's extrinsics, (3, 6)."""
    ups = np.concatenate([_fit(up, body, ideal) for up, _ in anchor.probes])
    downs = np.concatenate([_fit(down, body, ideal) for _, down in anchor.probes])
    return _difference(ups, downs).T / (2.0 * STEPS)


def _difference(up: Floats, down: Floats) -> Floats:
    found = up - down
    found[:, 2] = np.remainder(found[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    return found
