"""Estimates where the camera really is: the map file's calibration, corrected by the map's tags.

One small tag in a corner of the frame determines the camera's shift well, its yaw poorly (a tenth
of a pixel at the tag is millimetres at the far end) and its height and tilt hardly at all. A plain
perspective-n-point solution trusts it for all six and jumps between two solutions. Here the
calibration is a prior with a stated tolerance and the tags' corners are the measurement:
Gauss-Newton on

    (p - calibrated)' tolerance^-1 (p - calibrated)  +  (seen - projected)' noise^-1 (same)

lets the tags correct exactly what they measure better than the calibration did. `p` is the camera's
place, and its lens if the calibration has a covariance for it. A tag does not move, so its corners
are averaged over the last frames, which reduces noise; the covariance stays that of one frame,
because a static tag's corner errors are nearly the same in every frame. A camera that was knocked
sees a tag far outside the tolerance: then the tolerance is widened and the tags are trusted.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS
from scm.eye.camera import CameraModel
from scm.eye.detect import CORNER_STD_PX
from scm.log import event
from scm.records.city_map import MapTag
from scm.scenery.tags import floor_corners

LOGGER = logging.getLogger(__name__)
AVERAGED_FRAMES = 20  # of a tag at rest
MOVED_PX = 1.0  # a tag that moved by more is measured anew
STILL_PX = 0.006
"""Smaller changes of the averages do not trigger another solution."""
KNOCKED_SIGMAS = 5.0  # by which the camera was moved, against its stated place
KNOCKED_TOLERANCE = 30.0  # times the prior std of a camera that was moved
ITERATIONS = 4
EXTRINSICS_COUNT = 6
STEPS = np.array(
    [1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-2, 1e-2, 1e-2, 1e-2, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6]
)
"""Steps of the finite differences: camera's place (6), then fx, fy, cx, cy and distortion (9)."""
SURVEY_STD_M = 0.001
"""Standard deviation of every tag's place but the first, which defines the map [m]."""
BUMP_STD = np.array([0.05, 0.05, 0.02, 0.05, 0.02, 0.02])
"""Standard deviation of a bump that leaves the camera on its mount, [m] and [rad]."""
ROOF_M = 0.13  # height of a roof tag
GRID = np.linspace(0.1, 0.9, 4)


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
class Average:
    """Corners of a static tag, (4, 2) [px], averaged over some frames."""

    corners: Floats
    frames: int = 1


@dataclass(slots=True, eq=False)
class ExtrinsicsEstimator:
    """Estimates the camera, frame after frame.

    Attributes:
        tolerance: Of the calibration; None: the camera's `place_std`, else the default.
        tags: Of the map; the first defines its frame. A single tag may be given without a tuple.
        model: The estimated camera.
        covariance: Of its extrinsics, (6, 6); with the lens, if that has a covariance, (15, 15).
        probes: The camera changed by plus and minus `STEPS` in each of these.
        seen_ns: When a tag of the map was last seen; None before.
    """

    calibrated: CameraModel
    tags: tuple[MapTag, ...] | MapTag
    tolerance: Tolerance | None = None
    corner_std_px: float = CORNER_STD_PX
    model: CameraModel = field(init=False)
    covariance: Floats = field(init=False)
    probes: tuple[tuple[CameraModel, CameraModel], ...] = field(init=False)
    seen_ns: int | None = field(init=False, default=None)
    _first_ns: int | None = field(init=False, default=None)
    _averages: dict[int, Average] = field(init=False, default_factory=dict)
    _solved: dict[int, Floats] = field(init=False, default_factory=dict)
    _corner_stds_px: Mapping[int, float] = field(init=False, default_factory=dict)
    _knocked: bool = field(init=False, default=False)
    _base: tuple[Floats, Floats] = field(init=False)

    def __post_init__(self) -> None:
        """Start from the calibration alone."""
        if isinstance(self.tags, MapTag):
            self.tags = (self.tags,)
        self.model = self.calibrated
        count = EXTRINSICS_COUNT if self.calibrated.lens_covariance is None else len(STEPS)
        self.covariance = np.zeros((count, count))
        self.covariance[:EXTRINSICS_COUNT, :EXTRINSICS_COUNT] = np.diag(self._deviations() ** 2)
        if self.calibrated.lens_covariance is not None:
            self.covariance[EXTRINSICS_COUNT:, EXTRINSICS_COUNT:] = self.calibrated.lens_covariance
        self._base = parameters(self.model)[:count], self.covariance
        self.probes = self._probes()

    def _deviations(self) -> Floats:
        """Return the standard deviations of the calibration's place, (6,) [m] and [rad]."""
        stated = self.calibrated.camera.place_std
        if self.tolerance is None and stated is not None:
            return np.array(stated)
        return (self.tolerance or Tolerance()).deviations()

    @property
    def tag(self) -> MapTag:
        """The tag that defines the map's frame."""
        return self.map_tags[0]

    @property
    def map_tags(self) -> tuple[MapTag, ...]:
        """All tags of the map."""
        return (self.tags,) if isinstance(self.tags, MapTag) else self.tags

    @property
    def is_knocked(self) -> bool:
        """Whether the tags are further from the calibration than its tolerance explains."""
        return self._knocked

    def see(
        self,
        seen: Mapping[int, Floats] | Floats | None,
        t_ns: int,
        corner_stds_px: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        """Update with the corners of the map's tags in a frame, (4, 2) [px] by tag id.

        An array without an id is the first tag's; without any corners the last estimate stays. A
        blurred tag's corners are further off than `corner_std_px`; how far, its own std says.
        """
        self._corner_stds_px = corner_stds_px
        if self._first_ns is None:
            self._first_ns = t_ns
        if isinstance(seen, np.ndarray):
            seen = {self.tag.tag_id: seen}
        ours = {one.tag_id for one in self.map_tags}
        known = {tag_id: corners for tag_id, corners in (seen or {}).items() if tag_id in ours}
        if not known:
            return
        self.seen_ns = t_ns
        self._average(known)
        if self._has_moved():
            self._solve()

    def bumped(self) -> None:
        """Trust the tags from now on: the camera was moved by an unknown amount."""
        mean, covariance = parameters(self.model)[: len(self.covariance)], self.covariance.copy()
        covariance[:EXTRINSICS_COUNT, :EXTRINSICS_COUNT] += np.diag(BUMP_STD**2)
        self._base = mean, covariance
        self.covariance = covariance
        self._averages.clear()
        self._solved.clear()

    def age_ms(self, t_ns: int) -> float:
        """Return the time since a map tag was seen; if never, since the first frame."""
        since = self.seen_ns if self.seen_ns is not None else self._first_ns
        return (t_ns - since) / NS_PER_MS if since is not None else 0.0

    def expected(self, tag: MapTag, model: CameraModel | None = None) -> Floats:
        """Return where the corners of a map tag should be, (4, 2) [px]; by default as estimated."""
        return (model or self.model).project(floor_corners(tag))

    def deviation_sigmas(self, seen: Mapping[int, Floats]) -> float:
        """Return the largest deviation of map tags from the calibration, in standard deviations.

        Args:
            seen: Corners by tag id, (4, 2) [px], of at least one tag.
        """
        tags = [one for one in self.map_tags if one.tag_id in seen]
        corners = np.array([seen[one.tag_id] for one in tags])
        points = np.array([floor_corners(one) for one in tags])
        return self._deviation_sigmas(corners, points, self._base[1], self._noise(tags, points))

    def averaged(self) -> dict[int, Floats]:
        """Return the averaged corners of the tags seen, (4, 2) [px] by tag id."""
        return {tag_id: one.corners.copy() for tag_id, one in self._averages.items()}

    def max_position_std_m(self) -> float:
        """Return the largest position std of a roof over the frame, due to the camera alone [m]."""
        camera = self.model.camera
        across, down = np.meshgrid(GRID * camera.width_px, GRID * camera.height_px)
        pixels = np.stack((across.ravel(), down.ravel()), axis=-1)
        at = _lifted(self.model.on_plane(self.model.undistort(pixels), ROOF_M), ROOF_M)
        moved = -np.linalg.inv(by_place(self.model, at)) @ self.by_parameter(at)
        spread = moved @ self.covariance @ np.swapaxes(moved, -1, -2)
        return float(np.sqrt(np.linalg.eigvalsh(spread)[:, -1].max()))

    def by_parameter(self, points: Floats) -> Floats:
        """Return the derivative of pixels by each estimated parameter: (..., 3) to (..., 2, p)."""
        changes = [up.project(points) - down.project(points) for up, down in self.probes]
        return np.stack(changes, axis=-1) / (2.0 * STEPS[: len(changes)])

    def _average(self, seen: Mapping[int, Floats]) -> None:
        for tag_id, corners in seen.items():
            old = self._averages.get(tag_id)
            if old is not None and np.abs(corners - old.corners).max() > MOVED_PX:
                self._averages.clear()  # tags hidden now were seen from another place
                old = None
            if old is None:
                self._averages[tag_id] = Average(corners.copy())
                continue
            old.frames = min(old.frames + 1, AVERAGED_FRAMES)
            old.corners = old.corners + (corners - old.corners) / old.frames

    def _has_moved(self) -> bool:
        if self._averages.keys() != self._solved.keys():
            return True
        pairs = ((one.corners, self._solved[tag_id]) for tag_id, one in self._averages.items())
        return any(np.abs(now - then).max() > STILL_PX for now, then in pairs)

    def _solve(self) -> None:
        tags = [one for one in self.map_tags if one.tag_id in self._averages]
        corners = np.array([self._averages[one.tag_id].corners for one in tags])
        points = np.array([floor_corners(one) for one in tags])
        start, prior = self._base
        noise = self._noise(tags, points)
        prior = self._if_knocked(corners, points, prior, noise)
        jacobian = self.by_parameter(points).reshape(-1, len(start))
        gain = np.linalg.solve(jacobian @ prior @ jacobian.T + noise, jacobian @ prior).T
        at = start
        for _ in range(ITERATIONS):
            off = (corners - _changed(self.calibrated, at).project(points)).ravel()
            at = start + gain @ (off + jacobian @ (at - start))
        covariance = prior - gain @ jacobian @ prior
        self.covariance = (covariance + covariance.T) / 2.0
        self.model = _changed(self.calibrated, at)
        self.probes = self._probes()
        self._solved = {tag_id: one.corners.copy() for tag_id, one in self._averages.items()}

    def _noise(self, tags: list[MapTag], points: Floats) -> Floats:
        """Return the covariance of all corner coordinates, (8 n, 8 n) [px^2]."""
        stds = [self._corner_stds_px.get(one.tag_id, self.corner_std_px) for one in tags]
        noise = np.diag(np.repeat(np.square(stds), 8))
        for index, one in enumerate(tags):
            if one is not self.tag:
                shift = by_place(self.model, points[index]).reshape(8, 2)
                block = slice(8 * index, 8 * index + 8)
                noise[block, block] += SURVEY_STD_M**2 * shift @ shift.T
        return noise

    def _if_knocked(self, corners: Floats, points: Floats, prior: Floats, noise: Floats) -> Floats:
        """Return the prior, widened if a tag is outside its tolerance."""
        sigmas = self._deviation_sigmas(corners, points, prior, noise)
        knocked = sigmas > KNOCKED_SIGMAS
        if knocked and not self._knocked:
            facts = {"camera": self.model.camera.name, "surprise_sigmas": round(sigmas, 1)}
            event(LOGGER, "eye_camera_moved", level=logging.WARNING, **facts)
        self._knocked = knocked
        return prior * KNOCKED_TOLERANCE**2 if knocked else prior

    def _deviation_sigmas(
        self, corners: Floats, points: Floats, prior: Floats, noise: Floats
    ) -> float:
        """Return the largest distance of a tag from the prior's place, in standard deviations.

        Computed from tags' centres, which hardly depend on this camera's corner accuracy.
        """
        self.model = _changed(self.calibrated, self._base[0])
        self.probes = self._probes()
        off = (corners - self.model.project(points)).mean(axis=1)
        by_camera = self.by_parameter(points).mean(axis=1)
        floor = noise[:8, :8].max() * np.eye(2)
        covariance = by_camera @ prior @ np.swapaxes(by_camera, -1, -2) + floor
        squared = (off[:, None] @ np.linalg.solve(covariance, off[..., None])).max()
        return float(np.sqrt(squared))

    def _probes(self) -> tuple[tuple[CameraModel, CameraModel], ...]:
        at = parameters(self.model)[: len(self.covariance)]
        shifts = np.diag(STEPS[: len(at)])
        return tuple((_changed(self.model, at + d), _changed(self.model, at - d)) for d in shifts)


def by_place(model: CameraModel, points: Floats) -> Floats:
    """Return the derivative of pixels by a level step of map points: (..., 3) to (..., 2, 2)."""
    steps = np.eye(3)[:2] * 1e-5
    changes = [model.project(points + step) - model.project(points - step) for step in steps]
    return np.stack(changes, axis=-1) / 2e-5


def parameters(model: CameraModel) -> Floats:
    """Return the camera's place, fx, fy, cx, cy and distortion, (15,)."""
    camera = model.camera
    lens = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *model.distortion]
    return np.concatenate((model.extrinsics, lens))


def _changed(model: CameraModel, values: Floats) -> CameraModel:
    """Return the model with other extrinsics (6,), or with another lens too, (15,)."""
    moved = model.moved_to(values[:EXTRINSICS_COUNT])
    if len(values) == EXTRINSICS_COUNT:
        return moved
    fx, fy, cx, cy = (float(value) for value in values[EXTRINSICS_COUNT : EXTRINSICS_COUNT + 4])
    k1, k2, p1, p2, k3 = (float(value) for value in values[EXTRINSICS_COUNT + 4 :])
    camera = msgspec.structs.replace(
        moved.camera, fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=(k1, k2, p1, p2, k3)
    )
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return replace(moved, camera=camera, matrix=matrix, distortion=np.array(camera.distortion))


def _lifted(places: Floats, height: float) -> Floats:
    return np.concatenate((places, np.full((*places.shape[:-1], 1), height)), axis=-1)
