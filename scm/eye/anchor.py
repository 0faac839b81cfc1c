"""Where the camera really is: the calibration of the map file, corrected by the map's own tag.

One small tag in a corner of the frame tells the camera's shift well, its turn poorly (a tenth of a
pixel at the tag is millimetres at the far end) and its height and tilt hardly. A plain
perspective-n-point solution trusts it for all six at once and jumps between two solutions. Here the
calibration is a prior with a stated tolerance and the tag's eight corner coordinates are the
measurement: Gauss-Newton on

    sum ((extrinsics - calibrated) / tolerance)^2 + sum ((seen - projected) / corner_std)^2

lets the tag correct exactly what it can see better than the calibrator did. The tag lies still, so
its corners are averaged over the last frames, which calms the poses; the doubt stays that of one
frame, because a still tag's corners are off by nearly the same in every frame. A camera that was
knocked shows the tag far outside the tolerance: then the tolerance is widened and the tag believed.
"""

import logging
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS
from scm.eye.camera import CameraModel
from scm.eye.detect import CORNER_STD_PX
from scm.geometry import Pose2
from scm.log import event
from scm.maps.model import MapTag
from scm.scenery.tags import tag_corners

LOGGER = logging.getLogger(__name__)
AVERAGED_FRAMES = 20
MOVED_PX = 1.0
KNOCKED_SIGMAS = 5.0
KNOCKED_TOLERANCE = 30.0
ITERATIONS = 3
STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5])


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Standard deviations of a calibration: position [m], yaw and tilts [rad]."""

    position_m: float = 0.003
    height_m: float = 0.002
    yaw_rad: float = 0.001
    tilt_rad: float = 0.0005

    def deviations(self) -> Floats:
        """Return them in the order of `CameraModel.extrinsics`, (6,)."""
        across, tilt = self.position_m, self.tilt_rad
        return np.array([across, across, self.height_m, self.yaw_rad, tilt, tilt])


@dataclass(slots=True, eq=False)
class Anchor:
    """The corrected camera, frame after frame.

    Attributes:
        model: The camera where it now seems to be.
        covariance: Of its extrinsics, (6, 6).
        probes: The camera moved by plus and minus `STEPS` in each of its extrinsics.
        seen_ns: When the map's tag was last seen; None before.
    """

    calibrated: CameraModel
    tag: MapTag
    tolerance: Tolerance = field(default_factory=Tolerance)
    corner_std_px: float = CORNER_STD_PX
    model: CameraModel = field(init=False)
    covariance: Floats = field(init=False)
    probes: tuple[tuple[CameraModel, CameraModel], ...] = field(init=False)
    seen_ns: int | None = field(init=False, default=None)
    _first_ns: int | None = field(init=False, default=None)
    _corners: Floats | None = field(init=False, default=None)
    _averaged: int = field(init=False, default=0)
    _knocked: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        """Start from the calibration alone."""
        self.model = self.calibrated
        self.covariance = np.diag(self.tolerance.deviations() ** 2)
        self.probes = _probes(self.model)

    def see(self, corners: Floats | None, t_ns: int) -> None:
        """Take the map tag's corners in a frame, (4, 2) [px]; None keeps the last correction."""
        if self._first_ns is None:
            self._first_ns = t_ns
        if corners is None:
            return
        self.seen_ns = t_ns
        self._average(corners)
        self._solve()

    def age_ms(self, t_ns: int) -> float:
        """Return how long the map's tag has not been seen; never seen: since the first frame."""
        since = self.seen_ns if self.seen_ns is not None else self._first_ns
        return (t_ns - since) / NS_PER_MS if since is not None else 0.0

    def _average(self, corners: Floats) -> None:
        if self._corners is None or np.abs(corners - self._corners).max() > MOVED_PX:
            self._corners, self._averaged = corners.copy(), 0
        self._averaged = min(self._averaged + 1, AVERAGED_FRAMES)
        self._corners = self._corners + (corners - self._corners) / self._averaged

    def _solve(self) -> None:
        at = self.calibrated.extrinsics
        jacobian, tolerated = self._jacobian(at), self.tolerance.deviations() ** 2
        surprise = self._surprise(jacobian, tolerated)
        knocked = surprise > KNOCKED_SIGMAS
        if knocked:
            tolerated = tolerated * KNOCKED_TOLERANCE**2
        if knocked and not self._knocked:
            facts = {"camera": self.model.camera.name, "surprise_sigmas": round(surprise, 1)}
            event(LOGGER, "eye_camera_moved", level=logging.WARNING, **facts)
        self._knocked = knocked
        prior, weight = np.diag(1.0 / tolerated), self.corner_std_px**-2
        covariance = np.linalg.inv(prior + weight * jacobian.T @ jacobian).astype(np.float64)
        for _ in range(ITERATIONS):
            downhill = weight * jacobian.T @ self._residual(at)
            at = at + covariance @ (downhill - prior @ (at - self.calibrated.extrinsics))
        self.model, self.covariance = self.calibrated.moved_to(at), covariance
        self.probes = _probes(self.model)

    def _surprise(self, jacobian: Floats, tolerated: Floats) -> float:
        """Return how far the tag's middle is from where calibration puts it, in deviations.

        The middle, because it hardly depends on how well this camera's corners are found.
        """
        off = self._residual(self.calibrated.extrinsics).reshape(4, 2).mean(axis=0)
        by_camera = jacobian.reshape(4, 2, 6).mean(axis=0)
        doubt = (by_camera * tolerated) @ by_camera.T + self.corner_std_px**2 * np.eye(2)
        return float(np.sqrt(off @ np.linalg.solve(doubt, off)))

    def _residual(self, extrinsics: Floats) -> Floats:
        pose = Pose2(self.tag.x_m, self.tag.y_m, self.tag.yaw_rad)
        on_floor = [(*pose.apply(x, y), 0.0) for x, y in tag_corners(self.tag.size_m)]
        expected = self.calibrated.moved_to(extrinsics).project(np.array(on_floor))
        if self._corners is None:
            return np.zeros(8)
        return (self._corners - expected).ravel()

    def _jacobian(self, extrinsics: Floats) -> Floats:
        """Return the change of the projected corners by each of the extrinsics, (8, 6)."""
        shifts = np.diag(STEPS)
        columns = [
            (self._residual(extrinsics - shift) - self._residual(extrinsics + shift)) / (2.0 * step)
            for shift, step in zip(shifts, STEPS, strict=True)
        ]
        return np.column_stack(columns)


def _probes(model: CameraModel) -> tuple[tuple[CameraModel, CameraModel], ...]:
    at = model.extrinsics
    return tuple((model.moved_to(at + d), model.moved_to(at - d)) for d in np.diag(STEPS))
