"""The lens of an overhead camera: map points to pixels, and pixels back to rays.

    p_camera = camera_R_map (p_map - position)          a, b = p_x / p_z, p_y / p_z
    pixel = K distort(a, b)         pinhole: radial k1 k2 k3, tangential p1 p2 (OpenCV's five)
    fisheye: (a, b) scaled to length t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), t the angle between
    the ray and the axis (OpenCV's four)

Camera axes: x to the picture's right, y to its bottom, z out of the lens, so down to the floor. At
zero yaw and tilt the picture's right is the map's x and its top the map's y. Pixels: the centre of
the first pixel is (0, 0), as OpenCV has it.
"""

import math
from dataclasses import dataclass, replace

import cv2
import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError, MessageError, nearest
from scm.records.city_map import Camera, CityMap
from scm.v2x.key import check_name

MAX_TILT_RAD = math.radians(45.0)
LENS_PARAMETERS = 9
"""Number of lens parameters: fx, fy, cx, cy and five of the distortion."""
WIDEST_RAD = math.radians(89.9)
"""Rays further off a fisheye's axis cannot be represented by a pinhole."""
_UNDISTORT_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 400, 1e-12)
_NEWTON_STEPS = 4  # converges to rounding for lenses up to WIDEST_RAD


@dataclass(frozen=True, slots=True, eq=False)
class CameraModel:
    """A calibrated camera.

    Attributes:
        camera: As in the map file.
        matrix: K, (3, 3) [px].
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0; (5,).
        position: Optical centre in the map frame, (3,) [m].
        camera_R_map: Turns map directions into camera directions, (3, 3).
        lens_covariance: Of fx, fy, cx, cy and the distortion, (9, 9); None: taken as exact.
    """

    camera: Camera
    matrix: Floats
    distortion: Floats
    position: Floats
    camera_R_map: Floats  # noqa: N815  a_R_b: the frame on the right turned into the one on the left
    lens_covariance: Floats | None = None

    @property
    def camera_T_map(self) -> Floats:  # noqa: N802
        """The extrinsics as one matrix, (4, 4): map points to camera points."""
        transform = np.eye(4)
        transform[:3, :3] = self.camera_R_map
        transform[:3, 3] = -self.camera_R_map @ self.position
        return transform

    @property
    def extrinsics(self) -> Floats:
        """x, y, z [m], yaw, tilt x, tilt y [rad], as `moved_to` expects them, (6,)."""
        camera = self.camera
        tilts = camera.tilt_x_rad, camera.tilt_y_rad
        return np.array([camera.x_m, camera.y_m, camera.z_m, camera.yaw_rad, *tilts])

    def moved_to(self, extrinsics: Floats) -> "CameraModel":
        """Return the same lens at another place: x, y, z [m], yaw, tilt x, tilt y [rad]."""
        names = ("x_m", "y_m", "z_m", "yaw_rad", "tilt_x_rad", "tilt_y_rad")
        placed = {name: float(value) for name, value in zip(names, extrinsics, strict=True)}
        camera = msgspec.structs.replace(self.camera, **placed)
        position = np.array(extrinsics[:3], dtype=np.float64)
        return replace(self, camera=camera, position=position, camera_R_map=_rotation(camera))

    def project(self, points: Floats) -> Floats:
        """Return the pixels of map points: (..., 3) [m] to (..., 2) [px], inside the frame or not.

        Points must lie in front of the lens and near its field of view: far outside it the
        distortion polynomial folds back.
        """
        seen = (points - self.position) @ self.camera_R_map.T
        bend = _bend_fisheye if self.camera.lens == "fisheye" else _bend_pinhole
        x, y = bend(seen, self.distortion)
        camera = self.camera
        return np.stack((camera.fx_px * x + camera.cx_px, camera.fy_px * y + camera.cy_px), axis=-1)

    def undistort(self, pixels: Floats) -> Floats:
        """Return the coordinates in a perfect pinhole of focal length 1: (..., 2) to (..., 2).

        NaN where a fisheye looks 90 deg or more off its axis, or shows nothing at all.
        """
        if self.camera.lens == "fisheye":
            camera = self.camera
            middle = np.array([camera.cx_px, camera.cy_px])
            return _straight(
                (pixels - middle) / np.array([camera.fx_px, camera.fy_px]), self.distortion
            )
        flat = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        ideal = cv2.undistortPoints(
            flat, self.matrix, self.distortion, None, None, None, _UNDISTORT_UNTIL
        )
        return np.asarray(ideal, dtype=np.float64).reshape(pixels.shape)

    def on_plane(self, ideal: Floats, height: float) -> Floats:
        """Return where undistorted points meet the plane z = height: (..., 2) to (..., 2) [m]."""
        ahead = np.ones((*ideal.shape[:-1], 1))
        rays: Floats = np.concatenate((ideal, ahead), axis=-1) @ self.camera_R_map
        reach = (height - self.position[2]) / rays[..., 2:]
        met: Floats = self.position[:2] + reach * rays[..., :2]
        return met

    def sees(self, pixel: Floats, margin: float = 0.0) -> bool:
        """Return whether a pixel is in the frame, at least `margin` [px] from its edges."""
        x, y = float(pixel[0]), float(pixel[1])
        camera = self.camera
        across = margin - 0.5 <= x <= camera.width_px - 0.5 - margin
        return across and margin - 0.5 <= y <= camera.height_px - 0.5 - margin


def camera_of(city_map: CityMap, name: str | None) -> Camera:
    """Return a camera of a map by its name; None: its first.

    Raises:
        EyeError: There is none, or none of that name.
    """
    names = [camera.name for camera in city_map.cameras]
    if not names:
        raise EyeError(f"map {city_map.name}: [[cameras]]: expected at least one")
    if name is not None and name not in names:
        raise EyeError(
            f"map {city_map.name}: no camera {name!r}, expected one of {', '.join(names)}"
            f"{nearest(name, names)}"
        )
    return city_map.cameras[names.index(name) if name is not None else 0]


def camera_model(camera: Camera, lens_covariance: Floats | None = None) -> CameraModel:
    """Build the model of a map file's camera.

    Args:
        camera: As in the map file, or from `calibration.calibrated`.
        lens_covariance: Of fx, fy, cx, cy and the distortion, (9, 9), if the lens was calibrated.

    Raises:
        EyeError: naming every invalid key, with what was expected.
    """
    faults = _faults(camera, lens_covariance)
    if faults:
        raise EyeError(f"camera {camera.name!r}: " + "; ".join(faults))
    matrix = np.array(
        [[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]]
    )
    position = np.array([camera.x_m, camera.y_m, camera.z_m])
    model = CameraModel(
        camera, matrix, np.array(camera.distortion), position, _rotation(camera), lens_covariance
    )
    _refuse_folding(model)
    return model


def _bend_pinhole(seen: Floats, distortion: Floats) -> tuple[Floats, Floats]:
    """Project camera points (..., 3) with Brown's distortion, focal length 1."""
    a, b = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
    k1, k2, p1, p2, k3 = distortion
    r2 = a * a + b * b
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    x = a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a)
    y = b * radial + 2.0 * p2 * a * b + p1 * (r2 + 2.0 * b * b)
    return x, y


def _bend_fisheye(seen: Floats, distortion: Floats) -> tuple[Floats, Floats]:
    """Project camera points (..., 3) with a fisheye, focal length 1."""
    across = np.hypot(seen[..., 0], seen[..., 1])
    reach = _fisheye_reach(np.arctan2(across, seen[..., 2]), distortion)
    on_axis = across < 1e-12
    scale = np.where(on_axis, 1.0 / seen[..., 2], reach / np.where(on_axis, 1.0, across))
    return seen[..., 0] * scale, seen[..., 1] * scale


def _fisheye_reach(angle: Floats, distortion: Floats) -> Floats:
    """Return the image radius of a ray at an angle off the axis, focal length 1."""
    k1, k2, k3, k4, _ = distortion
    t2 = angle * angle
    reach: Floats = angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    return reach


def _straight(bent: Floats, distortion: Floats) -> Floats:
    """Return a fisheye's points as pinhole points, (..., 2) to (..., 2), by Newton's method."""
    k1, k2, k3, k4, _ = distortion
    wanted = np.hypot(bent[..., 0], bent[..., 1])
    angles = np.linspace(0.0, math.pi, 400)
    reaches = _fisheye_reach(angles, distortion)
    grows = np.diff(reaches) > 0.0
    last = len(angles) - 1 if grows.all() else int(np.argmin(grows))
    angle = np.interp(wanted, reaches[: last + 1], angles[: last + 1])
    for _ in range(_NEWTON_STEPS):
        t2 = angle * angle
        slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
        off = _fisheye_reach(angle, distortion) - wanted
        angle = np.clip(angle - off / np.where(slope > 1e-3, slope, 1.0), 0.0, angles[last])
    shown = (angle < WIDEST_RAD) & (wanted <= reaches[last])
    tangent = np.tan(np.where(shown, angle, 0.0))
    scale = np.where(wanted > 1e-12, tangent / np.maximum(wanted, 1e-12), 1.0)
    ideal: Floats = bent * np.where(shown, scale, np.nan)[..., None]
    return ideal


def _rotation(camera: Camera) -> Floats:
    c, s = math.cos(camera.yaw_rad), math.sin(camera.yaw_rad)
    level = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    cx, sx = math.cos(camera.tilt_x_rad), math.sin(camera.tilt_x_rad)
    cy, sy = math.cos(camera.tilt_y_rad), math.sin(camera.tilt_y_rad)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    turned: Floats = (about_x @ about_y).T @ level
    return turned


def _faults(camera: Camera, lens_covariance: Floats | None) -> list[str]:
    fifth, shape = camera.distortion[4], None if lens_covariance is None else lens_covariance.shape
    square = (LENS_PARAMETERS, LENS_PARAMETERS)
    checks: dict[str, tuple[object, bool, str]] = {
        "name": (camera.name, _is_valid_name(camera.name), "1 to 32 of a-z 0-9 _ -, and not pose"),
        "width_px": (camera.width_px, camera.width_px >= 16, "at least 16"),
        "height_px": (camera.height_px, camera.height_px >= 16, "at least 16"),
        "fx_px": (camera.fx_px, camera.fx_px > 0.0, "above 0"),
        "fy_px": (camera.fy_px, camera.fy_px > 0.0, "above 0"),
        "cx_px": (camera.cx_px, 0 <= camera.cx_px < camera.width_px, "inside the frame"),
        "cy_px": (camera.cy_px, 0 <= camera.cy_px < camera.height_px, "inside the frame"),
        "z_m": (camera.z_m, camera.z_m > 0.0, "above the floor"),
        "rate_hz": (camera.rate_hz, camera.rate_hz > 0.0, "above 0"),
        "place_std": (
            camera.place_std,
            all(0.0 < std < math.inf for std in camera.place_std or ()),
            "six above 0",
        ),
        "noise_sigma": (camera.noise_sigma, camera.noise_sigma >= 0.0, "at least 0"),
        "rolling_s": (camera.rolling_s, 0.0 <= camera.rolling_s < 1.0, "from 0 to below 1"),
        "distortion[4]": (fifth, camera.lens == "pinhole" or fifth == 0.0, "0 for a fisheye"),
        "lens_covariance": (shape, shape in {None, square}, f"shape {square}"),
    }
    for name in ("tilt_x_rad", "tilt_y_rad"):
        tilt = getattr(camera, name)
        checks[name] = (tilt, abs(tilt) < MAX_TILT_RAD, "a camera that looks down (below 0.78)")
    return [
        f"{k}: expected {want}, got {got}" for k, (got, good, want) in checks.items() if not good
    ]


def _is_valid_name(name: str) -> bool:
    """Return whether a camera may have this name: `eye/pose/...` is the tracks' key."""
    try:
        return check_name(name, "camera") != "pose"
    except MessageError:
        return False


def _refuse_folding(model: CameraModel) -> None:
    camera = model.camera
    far_x = max(camera.cx_px, camera.width_px - camera.cx_px) / camera.fx_px
    far_y = max(camera.cy_px, camera.height_px - camera.cy_px) / camera.fy_px
    corner = math.hypot(far_x, far_y)
    if camera.lens == "fisheye":
        image = _fisheye_reach(np.linspace(0.0, math.pi, 400), model.distortion)
    else:
        k1, k2, _, _, k3 = model.distortion
        r = np.linspace(0.0, 1.5 * corner, 200)
        image = r * (1.0 + r**2 * (k1 + r**2 * (k2 + r**2 * k3)))
    shrinks = np.diff(image) <= 0.0
    still = int(np.argmax(shrinks)) if shrinks.any() else len(image) - 1
    if image[still] < corner:
        raise EyeError(
            f"camera {camera.name!r}: distortion: expected a picture that grows outwards up to its "
            f"corner at {corner:.3f} focal lengths, got one that folds back at {image[still]:.3f}"
        )
