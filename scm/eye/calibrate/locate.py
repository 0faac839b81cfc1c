"""Locates a camera from tags whose places on the map are known.

The corners lie in one plane, the floor, so four of them fit two poses: the camera here, or on the
other side tilted the other way. Both are refined to the minimum of the corners' errors (x, y, z,
yaw and two tilts, Gauss-Newton) and weighted by their fit:

    weight ~ exp(-chi^2 / 2)        chi^2 = sum (error / corner noise)^2

The covariance includes the noise of the corners and the covariance of the lens. Several tags, far
apart, determine both the choice and the values well; one small tag determines height and tilt
poorly, as the covariance shows.
"""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.camera import LENS_PARAMETERS, MAX_TILT_RAD, CameraModel, camera_model
from scm.eye.detect import CORNER_STD_PX
from scm.geometry import wrap_angle
from scm.records.city_map import Camera, CityMap, MapTag
from scm.records.eye import TagSeen
from scm.records.floor import Record
from scm.scenery.tags import TAG_COUNT, floor_corners

NAMES = ("x_m", "y_m", "z_m", "yaw_rad", "tilt_x_rad", "tilt_y_rad")
MIN_UNIQUE_WEIGHT = 0.95  # of a pose that counts as the only solution
OUTLIER_SIGMAS = 8.0  # residual of a tag that is not at its stated place
MIN_OUTLIER_PX = 0.5  # smaller residuals are never outliers
_STEPS = np.array([1e-5, 1e-5, 1e-5, 1e-6, 1e-6, 1e-6])
_ITERATIONS = 30
_LENS_STEP = 1e-6


class _Tag(Record, kw_only=True, frozen=True):
    id: int
    x_m: float
    y_m: float
    yaw_rad: float = 0.0
    size_m: float


class _Tags(Record, kw_only=True, frozen=True):
    tags: tuple[_Tag, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """One pose that the tags allow.

    Attributes:
        model: The camera there.
        covariance: Of x, y, z [m], yaw, tilt x, tilt y [rad], (6, 6).
        rms_px: RMS residual at the corners, per corner.
        weight: Probability of this pose among those allowed, 0 to 1.
    """

    model: CameraModel
    covariance: Floats
    rms_px: float
    weight: float

    @property
    def deviations(self) -> Floats:
        """Standard deviations of the six values, (6,)."""
        deviations: Floats = np.sqrt(np.diag(self.covariance))
        return deviations

    @property
    def tilt_rad(self) -> float:
        """Between the view and straight down."""
        return float(np.arccos(np.clip(-self.model.camera_R_map[2, 2], -1.0, 1.0)))


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """The located camera of a picture.

    Attributes:
        places: The allowed poses, the most probable first.
        used: Ids of the tags used.
        wrong: Ids of tags left out, since they are not at their stated places.
    """

    places: tuple[Place, ...]
    used: tuple[int, ...]
    wrong: tuple[int, ...] = ()

    @property
    def is_sure(self) -> bool:
        """Whether one pose is clearly more probable than the other."""
        return self.places[0].weight >= MIN_UNIQUE_WEIGHT


def known_tags(city_map: CityMap, more: Path | None = None) -> dict[int, MapTag]:
    """Return the tags with known places: the map's own, and those in a file of `[[tags]]`.

    Raises:
        EyeError: The file is missing or invalid, or lists a tag twice.
    """
    tags = {city_map.tag.tag_id: city_map.tag}
    if more is None:
        return tags
    if not more.is_file():
        raise EyeError(f"{more}: expected a file of [[tags]], found none")
    try:
        read = msgspec.convert(tomllib.loads(more.read_text(encoding="utf-8")), _Tags)
    except (ValueError, RecursionError, OSError) as error:
        raise EyeError(f"{more}: expected [[tags]] of id, x_m, y_m, size_m: {error}") from error
    for tag in read.tags:
        if tag.id in tags:
            raise EyeError(
                f"{more}: tag {tag.id}: expected each once, got it again or as the map's"
            )
        faults = _faults(tag)
        if faults:
            raise EyeError(f"{more}: tag {tag.id}: {'; '.join(faults)}")
        tags[tag.id] = MapTag(
            tag_id=tag.id, x_m=tag.x_m, y_m=tag.y_m, yaw_rad=tag.yaw_rad, size_m=tag.size_m
        )
    return tags


def _faults(tag: _Tag) -> list[str]:
    numbers = {"x_m": tag.x_m, "y_m": tag.y_m, "yaw_rad": tag.yaw_rad}
    faults = [
        f"{name}: expected a number, got {got}"
        for name, got in numbers.items()
        if not math.isfinite(got)
    ]
    if not 0 <= tag.id < TAG_COUNT:
        faults.append(f"id: expected 0 to {TAG_COUNT - 1}")
    if not 0.0 < tag.size_m < math.inf:
        faults.append(f"size_m: expected above 0, got {tag.size_m}")
    return faults


def locate(
    camera: Camera,
    tags: Mapping[int, MapTag],
    seen: Sequence[TagSeen],
    lens_covariance: Floats | None = None,
    corner_std_px: float = CORNER_STD_PX,
) -> Located:
    """Return the pose of the camera that sees these tags.

    Args:
        camera: Its lens and frame; its stated place is not used.
        tags: Tags on the floor, by id.
        seen: In the picture; those not in `tags` are ignored.
        lens_covariance: Of the lens, (9, 9).
        corner_std_px: Noise of a corner coordinate; more is assumed if the corners show more.

    Raises:
        EyeError: No known tag is seen, or no camera that looks down (below 45 deg) fits.
    """
    known = {tag.tag_id: np.array(tag.corners_px) for tag in seen if tag.tag_id in tags}
    if not known:
        others = ", ".join(str(tag.tag_id) for tag in seen) or "none"
        wanted = ", ".join(str(tag_id) for tag_id in sorted(tags))
        raise EyeError(f"locate: expected a tag of {wanted} in the picture, got {others}")
    model = camera_model(_levelled(camera), lens_covariance)
    wrong: list[int] = []
    while True:
        places = _places(model, tags, known, corner_std_px)
        off = _worst_tag(places[0].model, tags, known, corner_std_px) if len(known) > 2 else None
        if off is None:
            return Located(tuple(places), tuple(sorted(known)), tuple(wrong))
        wrong.append(off)
        del known[off]


def off_px(model: CameraModel, tag: MapTag, corners: Floats) -> Floats:
    """Return the deviation of a tag's corners from their projection, (4, 2) [px]."""
    return corners - model.project(floor_corners(tag))


def _levelled(camera: Camera) -> Camera:
    """Return the lens at a place that is always valid: the map's may be a placeholder."""
    place = {"x_m": 0.0, "y_m": 0.0, "z_m": 1.0}
    turn = {"yaw_rad": 0.0, "tilt_x_rad": 0.0, "tilt_y_rad": 0.0}
    return msgspec.structs.replace(camera, **place, **turn)


def _places(
    model: CameraModel, tags: Mapping[int, MapTag], known: Mapping[int, Floats], noise: float
) -> list[Place]:
    points = np.concatenate([floor_corners(tags[tag_id]) for tag_id in known])
    pixels = np.concatenate(list(known.values()))
    solutions: list[Floats] = []
    for start in _starts(model, points, pixels):
        end = _refine(model, points, pixels, start)
        if end is not None and not any(np.abs(end - one).max() < 1e-4 for one in solutions):
            solutions.append(end)
    if not solutions:
        raise EyeError(
            f"locate: no camera above the floor that looks down (below "
            f"{math.degrees(MAX_TILT_RAD):.0f} deg) sees tags {sorted(known)} like this; are "
            "sizes and places right?"
        )
    left = [float(((pixels - model.moved_to(at).project(points)) ** 2).sum()) for at in solutions]
    spare = max(2 * len(points) - 6, 1)
    noise = max(noise, math.sqrt(min(left) / spare))
    weights = np.exp(-0.5 * (np.array(left) - min(left)) / noise**2)
    weights /= weights.sum()
    places = [
        Place(
            model.moved_to(at),
            _covariance(model.moved_to(at), points, noise),
            math.sqrt(rest / len(points)),
            float(weight),
        )
        for at, rest, weight in zip(solutions, left, weights, strict=True)
    ]
    return sorted(places, key=lambda place: -place.weight)


def _starts(model: CameraModel, points: Floats, pixels: Floats) -> list[Floats]:
    """Return the poses that the planar problem allows, as extrinsics (6,)."""
    ideal = model.undistort(pixels)
    shown = np.isfinite(ideal).all(axis=1)
    if shown.sum() < 4:
        return []
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        points[shown], ideal[shown], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    starts = []
    for turn, shift in zip(turns, shifts, strict=True):
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        start = _extrinsics(rotation, -rotation.T @ np.ravel(shift))
        if start is not None:
            starts.append(start)
    return starts


def _extrinsics(rotation: Floats, position: Floats) -> Floats | None:
    """Return camera_R_map and place as `CameraModel.extrinsics`; None if it does not look down."""
    yaw = math.atan2(rotation[1, 0], -rotation[1, 1])
    c, s = math.cos(yaw), math.sin(yaw)
    level = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    tilted = level @ rotation.T
    tilts = math.atan2(tilted[2, 1], tilted[1, 1]), math.atan2(tilted[0, 2], tilted[0, 0])
    if position[2] <= 0.0 or max(abs(tilt) for tilt in tilts) >= MAX_TILT_RAD:
        return None
    return np.array([*position, yaw, *tilts])


def _refine(model: CameraModel, points: Floats, pixels: Floats, start: Floats) -> Floats | None:
    """Return the extrinsics that minimise the corners' errors; None if out of bounds."""
    at, damping = start, 1e-9
    cost = float(((pixels - model.moved_to(at).project(points)) ** 2).sum())
    for _ in range(_ITERATIONS):
        here = model.moved_to(at)
        jacobian = _by_place(here, points)
        normal = jacobian.T @ jacobian
        normal += damping * np.diag(np.diag(normal))
        step = np.linalg.solve(normal, jacobian.T @ (pixels - here.project(points)).ravel())
        new = float(((pixels - model.moved_to(at + step).project(points)) ** 2).sum())
        if not new <= cost:
            damping = max(damping * 100.0, 1e-6)
            if damping > 1e6:
                break
            continue
        at, gain, cost, damping = at + step, cost - new, new, damping / 100.0
        if gain <= 1e-12 * cost:
            break
    if at[2] <= 0.0 or np.abs(at[4:]).max() >= MAX_TILT_RAD:
        return None
    return np.array([*at[:3], wrap_angle(float(at[3])), *at[4:]])


def _by_place(model: CameraModel, points: Floats) -> Floats:
    """Return the derivative of the pixels by the extrinsics, (2n, 6)."""
    at = model.extrinsics
    columns = [
        (model.moved_to(at + shift).project(points) - model.moved_to(at - shift).project(points))
        for shift in np.diag(_STEPS)
    ]
    return np.column_stack([column.ravel() for column in columns]) / (2.0 * _STEPS)


def _by_lens(model: CameraModel, points: Floats) -> Floats:
    """Return the derivative of the pixels by the lens parameters, (2n, 9)."""
    camera = model.camera
    values = np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.distortion])
    by_lens = np.zeros((2 * len(points), LENS_PARAMETERS))
    for i in range(LENS_PARAMETERS - (camera.lens == "fisheye")):
        step = np.zeros(LENS_PARAMETERS)
        step[i] = _LENS_STEP * max(1.0, abs(values[i]))
        up, down = (_with_lens(model, values + side).project(points) for side in (step, -step))
        by_lens[:, i] = (up - down).ravel() / (2.0 * step[i])
    return by_lens


def _with_lens(model: CameraModel, values: Floats) -> CameraModel:
    fx, fy, cx, cy, a, b, c, d, e = (float(value) for value in values)
    named = {"fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy, "distortion": (a, b, c, d, e)}
    return camera_model(msgspec.structs.replace(model.camera, **named))


def _covariance(model: CameraModel, points: Floats, noise: float) -> Floats:
    jacobian = _by_place(model, points)
    normal = np.linalg.inv(jacobian.T @ jacobian)
    covariance = noise**2 * normal
    if model.lens_covariance is not None:
        by_lens = normal @ jacobian.T @ _by_lens(model, points)
        covariance = covariance + by_lens @ model.lens_covariance @ by_lens.T
    symmetric: Floats = (covariance + covariance.T) / 2.0
    return symmetric


def _worst_tag(
    model: CameraModel, tags: Mapping[int, MapTag], known: Mapping[int, Floats], noise: float
) -> int | None:
    """Return the tag that is not at its stated place, if one is an outlier."""
    off = {
        tag_id: float(np.hypot(*off_px(model, tags[tag_id], at).T).mean())
        for tag_id, at in known.items()
    }
    worst = max(off, key=lambda tag_id: off[tag_id])
    others = float(np.median(list(off.values())))
    limit = max(OUTLIER_SIGMAS * noise, MIN_OUTLIER_PX, 2.5 * others)
    return worst if off[worst] > limit else None
