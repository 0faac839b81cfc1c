"""From the corners of a roof tag to the pose of its car, with covariance.

The roof's height is known, so the depth need not be estimated from the tag's few pixels: the rays
of the four corners are intersected with the level plane at that height, and a square of the tag's
size is fitted to the four points by least squares. The rear axle is then at the tag's offset,
behind it along the car's own axis. So a camera may be tilted, and a square cannot be mistaken for
its mirror image as in a free perspective-n-point solution.

    yaw = atan2(sum c x q, sum c . q)      c: corners of the tag, q: points on the plane, centred
    axle = middle - R(yaw) offset

The covariance is propagated: noise of the corners, covariance of the camera's place and lens
(shared by all cars of a frame, and by all frames), and roll and pitch of the body, which move the
roof but cannot be observed. The residual is the distance of the points from the square, relative
to corner noise. One corner that corrupts an otherwise good square is left out; a remaining residual
widens the covariance. Where a square of another size fits clearly better, the print has another
size or the roof another height: centre and yaw are the same for any size, so there is a pose,
`size_ratio` is the apparent size, and beyond `SIZE_TOLERANCE` the covariance includes half the
shift that another height would cause. Corners that fit no square of any size (`MAX_MISFIT`) are no
tag.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats, Ints
from scm.eye.camera import CameraModel
from scm.eye.extrinsics import ExtrinsicsEstimator, by_place
from scm.geometry import Pose2, wrap_angle
from scm.scenery.bodies import CarBody
from scm.scenery.tags import CORNERS

ROLL_PITCH_STD_RAD = 0.003
"""Standard deviation of roll and of pitch of a scaled car."""
MISFIT = 2.0
"""RMS deviation that corner noise exceeds for one in 1000 squares."""
MAX_MISFIT = 20.0  # of corners that can be a square
SIZE_TOLERANCE = 0.025
"""Larger size errors are reported; printers are accurate to 1 %, "fit to page" is not: A4 on Letter
paper loses 3 to 7 %."""
CLEARLY = 3.0
"""A corner is left out if the square fits this much better without it than without any other."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """Pose of the rear axle in the map frame, and covariance over x, y, yaw, (3, 3).

    Attributes:
        shared: Part of it common to all sightings by this camera, (3, 3).
        common_mode: Part of it common to all cameras, from roll and pitch of the body, (3, 3).
        misfit: Deviation of the corners from a square, over corner noise: about 1.
        size_ratio: Apparent edge of the square on this roof over that of the car file; 1 where
            the car file's fits as well.
    """

    pose: Pose2
    covariance: Floats
    shared: Floats
    common_mode: Floats
    misfit: float
    size_ratio: float = 1.0

    @property
    def is_refused(self) -> bool:
        """Whether these corners are no square."""
        return not self.misfit < MAX_MISFIT

    @property
    def is_other_size(self) -> bool:
        """Whether the size differs from the car file's by more than printing errors."""
        return abs(self.size_ratio - 1.0) > SIZE_TOLERANCE


def car_pose(estimator: ExtrinsicsEstimator, body: CarBody, corners: Floats) -> PoseEstimate:
    """Return the pose of the car whose roof tag has these corners, (4, 2) [px]."""
    return car_poses(estimator, [body], corners[None])[0]


def car_poses(
    estimator: ExtrinsicsEstimator, bodies: Sequence[CarBody], corners: Floats
) -> tuple[PoseEstimate, ...]:
    """Return the poses of a frame's cars from their roof tags' corners, (n, 4, 2) [px]."""
    if not bodies:
        return ()
    model, std = estimator.model, estimator.corner_std_px
    offsets = np.array([body.tag_position for body in bodies])
    square = CORNERS * np.array([body.tag_size for body in bodies])[:, None, None]
    points = _on_roofs(model, model.undistort(corners), offsets[:, 2])
    by_metre = by_place(model, points)
    by_pixel = np.linalg.inv(by_metre)
    on = _Square(points[..., :2], by_metre, square, offsets[:, :2], std)
    fit = _patched(on)
    widened = std * np.maximum(1.0, np.minimum(fit.misfit, MAX_MISFIT) / MISFIT)
    ratios = _resized(on, fit)
    by_corner = np.einsum("nkij,nijp->nkip", fit.slopes, by_pixel).reshape(-1, 3, 8)
    by_corner *= widened[:, None, None]
    moved = -by_pixel @ estimator.by_parameter(points)
    by_camera = np.einsum("nkij,nijp->nkp", fit.slopes, moved)
    shared = by_camera @ estimator.covariance @ by_camera.swapaxes(1, 2)
    from_above = model.position - points.mean(axis=1)
    slant = np.hypot(from_above[:, 0], from_above[:, 1]) / from_above[:, 2]
    shared[:, 2, 2] += (
        ROLL_PITCH_STD_RAD * slant / 2.0
    ) ** 2  # roll and pitch, seen at an angle, look like yaw
    shared[:, :2, :2] += _by_height(from_above, ratios)
    common_mode = np.zeros((len(bodies), 3, 3))
    common_mode[:, [0, 1], [0, 1]] = ((offsets[:, 2] * ROLL_PITCH_STD_RAD) ** 2)[:, None]
    covariance = by_corner @ by_corner.swapaxes(1, 2) + shared + common_mode
    covariance = (covariance + covariance.swapaxes(1, 2)) / 2.0
    return tuple(
        PoseEstimate(Pose2(float(x), float(y), wrap_angle(float(yaw))), *rest)
        for (x, y, yaw), *rest in zip(
            fit.poses,
            covariance,
            shared,
            common_mode,
            fit.misfit.tolist(),
            ratios.tolist(),
            strict=True,
        )
    )


def _by_height(from_above: Floats, ratios: Floats) -> Floats:
    """Return the additional covariance if the height is what differs, (n, 2, 2) [m^2].

    Args:
        from_above: From the roofs' tags to the camera, (n, 3) [m].
        ratios: Of the squares' sizes, (n,).
    """
    is_other = np.abs(ratios - 1.0) > SIZE_TOLERANCE
    moved = from_above[:, :2] * np.where(is_other, 1.0 - 1.0 / ratios, 0.0)[:, None] / 2.0
    return np.asarray(moved[:, :, None] * moved[:, None, :])


@dataclass(frozen=True, slots=True, eq=False)
class _Square:
    """Points to which squares are fitted.

    Attributes:
        points: On the level plane, (n, 4, 2) [m].
        by_metre: Derivative of pixels by these, (n, 4, 2, 2).
        square: Corners of the tags in their own frames, (n, 4, 2) [m].
        offsets: Of the tags before and left of the rear axle, (n, 2) [m].
        std: Of a corner coordinate [px].
    """

    points: Floats
    by_metre: Floats
    square: Floats
    offsets: Floats
    std: float

    def of(self, cars: Ints) -> "_Square":
        """Return a subset."""
        found = self.points[cars], self.by_metre[cars], self.square[cars], self.offsets[cars]
        return _Square(*found, self.std)


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """Poses (n, 3) of rear axles, derivatives by each point (n, 3, 4, 2), and misfits (n,)."""

    poses: Floats
    slopes: Floats
    misfit: Floats


def _patched(on: _Square) -> _Fit:
    """Return the fits, each without its one bad corner, if there is one."""
    fit = _fitted(on, np.ones(4))
    bad = np.flatnonzero(fit.misfit > MISFIT)
    if not len(bad):
        return fit
    without = [_fitted(on.of(bad), weights) for weights in 1.0 - np.eye(4)]
    misfits = np.array([one.misfit for one in without])
    best, second = np.sort(misfits, axis=0)[:2]
    for index in np.flatnonzero((best < MISFIT) & (second > CLEARLY * best)):
        car, one = bad[index], without[int(misfits[:, index].argmin())]
        fit.poses[car], fit.slopes[car] = one.poses[index], one.slopes[index]
        fit.misfit[car] = one.misfit[index]
    return fit


def _resized(on: _Square, fit: _Fit) -> Floats:
    """Return the size ratios, (n,), and use the misfits of resized squares that fit better."""
    ratios = np.ones(len(fit.misfit))
    bad = np.flatnonzero(fit.misfit > MISFIT)
    if not len(bad):
        return ratios
    some = on.of(bad)
    spread = some.points - some.points.mean(axis=1, keepdims=True)
    c, s = np.cos(fit.poses[bad, 2]), np.sin(fit.poses[bad, 2])
    turn = np.stack((np.stack((c, s), axis=-1), np.stack((-s, c), axis=-1)), axis=1)
    along = (turn @ spread.swapaxes(1, 2)).swapaxes(1, 2)
    ratio = (along * some.square).sum((1, 2)) / (some.square**2).sum((1, 2))
    other = _fitted(replace(some, square=some.square * ratio[:, None, None]), np.ones(4))
    better = CLEARLY * other.misfit < fit.misfit[bad]
    fit.misfit[bad[better]] = other.misfit[better]
    ratios[bad[better]] = ratio[better]
    return ratios


def _fitted(on: _Square, weights: Floats) -> _Fit:
    """Fit the squares to their points, with corner weights, (4,)."""
    share = weights / weights.sum()
    centre = np.einsum("i,nij->nj", share, on.square)
    middle = np.einsum("i,nij->nj", share, on.points)
    spokes = on.square - centre[:, None]
    spread = on.points - middle[:, None]
    heavy = weights[:, None] * spokes
    across = np.stack((-heavy[..., 1], heavy[..., 0]), axis=-1)
    sine, cosine = (across * spread).sum((1, 2)), (heavy * spread).sum((1, 2))
    yaw = np.arctan2(sine, cosine)
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.stack((np.stack((c, -s), axis=-1), np.stack((s, c), axis=-1)), axis=1)
    to_axle = (turn @ (centre + on.offsets)[..., None])[..., 0]
    poses = np.column_stack((middle - to_axle, yaw))
    size = (sine**2 + cosine**2)[:, None, None]
    by_yaw = (cosine[:, None, None] * across - sine[:, None, None] * heavy) / size
    sideways = np.stack((-to_axle[:, 1], to_axle[:, 0]), axis=-1)
    place = np.eye(2)[None, :, None, :] * share[None, None, :, None]
    place = place - sideways[:, :, None, None] * by_yaw[:, None]
    slopes = np.concatenate((place, by_yaw[:, None]), axis=1)
    off = on.by_metre @ (spread - spokes @ turn.swapaxes(1, 2))[..., None]
    squared = np.einsum("i,nijk->n", weights, off**2) / (2.0 * weights.sum() - 3.0)
    return _Fit(poses, slopes, np.sqrt(squared) / on.std)


def _on_roofs(model: CameraModel, ideal: Floats, heights: Floats) -> Floats:
    """Intersect rays (n, 4, 2) with the levels of n roofs, (n, 4, 3) [m]."""
    rays = np.concatenate((ideal, np.ones((*ideal.shape[:-1], 1))), axis=-1) @ model.camera_R_map
    reach = (heights - model.position[2])[:, None, None] / rays[..., 2:]
    met: Floats = model.position + reach * rays
    return met
