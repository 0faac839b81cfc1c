"""Lens calibrations in files: our own TOML, ROS' `camera_info`, and OpenCV's FileStorage.

ROS: the YAML of `camera_calibration`, or an echoed `CameraInfo` message; `plumb_bob`,
`rational_polynomial` and `equidistant` (our fisheye). OpenCV: YAML, XML or JSON, by whatever
common names the matrix, the coefficients and the frame's size are stored. More than five
coefficients are approximated by five, and refused if the residual exceeds `RMS_SHARE` of the width.

These files hold no covariance. The assumed one makes each ray uncertain by `ASSUMED_RAY_SHARE` of
the frame's width, or by the reprojection error if that is larger.
"""

import logging
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.calibrate.assessment import RMS_SHARE
from scm.eye.calibration import LENS_NAMES, Calibration, covariance_faults
from scm.eye.camera import LENS_PARAMETERS, CameraModel, camera_model
from scm.eye.extrinsics import STEPS, parameters
from scm.log import event
from scm.yaml_file import read_yaml

LOGGER = logging.getLogger(__name__)
ASSUMED_RAY_SHARE = 5e-4
"""Assumed ray standard deviation over the frame's width, of a lens whose file has no covariance: as
much as `scm eye calibrate` accepts at the board's points."""
MAX_SKEW_SHARE = 1e-4  # of the width: a lens with skew has no place in our model
GRID = 24
"""Grid points along each side of the frame at which two lenses are compared."""
EXPECTED = (
    "expected a lens: TOML of `scm eye calibrate`, a ROS camera_info YAML, or YAML, XML or JSON of "
    "OpenCV's FileStorage"
)
_MATRIX = ("cameramatrix", "k", "intrinsicmatrix", "intrinsics", "mtx", "cammatrix")
_COEFFICIENTS = (
    *("distortioncoefficients", "distcoeffs", "distcoeff", "distortioncoeffs", "distortioncoeff"),
    *("d", "dist", "distortion"),
)
_WIDTH, _HEIGHT = ("imagewidth", "width", "framewidth"), ("imageheight", "height", "frameheight")
_SIZE = ("imagesize", "framesize", "resolution", "size")
_RMS = ("avgreprojectionerror", "reprojectionerror", "rms", "rmserror", "ret")
_VIEWS = ("nrofframes", "nframes", "framescount")
_FISHEYE = ("equidistant", "fisheye", "kannalabrandt", "kannalabrandt4")
_BROWN = ("", "plumbbob", "radtan", "pinhole", "opencv", "rationalpolynomial", "thinprism")
Format = Literal["scm", "ros", "opencv"]
LensKind = Literal["pinhole", "fisheye"]
Five = tuple[float, float, float, float, float]


def load_calibration(path: Path, size_px: tuple[int, int] | None = None) -> Calibration:
    """Return the calibration in a file; log what was assumed for missing values.

    Args:
        path: The file.
        size_px: Width and height of the camera's frames, for files that do not hold them.

    Raises:
        EyeError: There is no such file, or it is no calibration; with key, expected and got.
    """
    calibration, remarks = read_calibration(path, size_px)
    for remark in remarks:
        event(LOGGER, "calibration_completed", level=logging.WARNING, file=path, said=repr(remark))
    return calibration


def read_calibration(
    path: Path, size_px: tuple[int, int] | None = None
) -> tuple[Calibration, tuple[str, ...]]:
    """Return the calibration in a file, and sentences on what was assumed for missing values.

    Raises:
        EyeError: As `load_calibration`.
    """
    if not path.is_file():
        raise EyeError(f"{path}: found no file; {EXPECTED}")
    kind = _kind(path)
    if kind == "toml":
        return _own(path), ()
    read = _xml(path) if kind == "xml" else read_yaml(path, EyeError, EXPECTED, first=True)
    if not isinstance(read, dict) or not read:
        raise EyeError(f"{path}: {EXPECTED}")
    return _Foreign(path, read).calibration(size_px)


def _kind(path: Path) -> Literal["toml", "yaml", "xml"]:
    with path.open("rb") as file:
        head = file.read(512).lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith((b"<?xml", b"<opencv_storage")):
        return "xml"
    suffix = path.suffix.lower()
    is_yaml = suffix in {".yaml", ".yml", ".json"} or head.startswith((b"%YAML", b"---", b"{"))
    return "yaml" if is_yaml else "toml"


def _own(path: Path) -> Calibration:
    try:
        read = tomllib.loads(path.read_text(encoding="utf-8"))
        calibration = msgspec.convert(read, Calibration)
    except (ValueError, RecursionError, OSError) as error:
        raise EyeError(f"{path}: {error}; {EXPECTED}") from error
    faults = covariance_faults(calibration.covariance)
    if faults:
        raise EyeError(f"{path}: covariance: {faults}")
    return calibration


def _xml(path: Path) -> Any:
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        return _node(storage.root())
    except (cv2.error, SystemError) as error:
        raise EyeError(f"{path}: OpenCV cannot read this XML; {EXPECTED}") from error


def _node(node: Any) -> Any:
    """Return a node of OpenCV's FileStorage as plain data; None for kinds that no lens needs."""
    if node.isMap():
        if "dt" in node.keys():  # noqa: SIM118  no mapping of Python's
            return node.mat().tolist()
        return {key: _node(node.getNode(key)) for key in node.keys()}  # noqa: SIM118
    if node.isSeq():
        return [_node(node.at(index)) for index in range(node.size())]
    if node.isString():
        return node.string()
    return node.real() if node.isInt() or node.isReal() else None


class _Foreign:
    """A file of ROS or OpenCV, read by the usual names of its values."""

    def __init__(self, path: Path, read: Mapping[Any, Any]) -> None:
        self._path = path
        self._read = {_plain(str(key)): value for key, value in read.items()}
        self._keys = ", ".join(str(key) for key in list(read)[:12])

    def calibration(self, size_px: tuple[int, int] | None) -> tuple[Calibration, tuple[str, ...]]:
        """Return the lens, and sentences on what was assumed for missing values."""
        remarks: list[str] = []
        width, height = self._frame_size(size_px, remarks)
        fx, fy, cx, cy = self._focal(width)
        numbers = self._coefficients()
        rms = self._number(_RMS, 0.0)
        focal = {"fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy}
        lens, five = self._five(numbers, focal, (width, height), remarks)
        zeros = ((0.0,) * LENS_PARAMETERS,) * LENS_PARAMETERS
        made = Calibration(
            lens=lens, width_px=width, height_px=height, **focal, distortion=five,
            covariance=zeros, rms_px=rms, views=int(self._number(_VIEWS, 0.0)),
        )  # fmt: skip
        try:
            model = camera_model(made.camera())
        except EyeError as error:
            raise EyeError(f"{self._path}: {error}") from error
        ray_px = max(ASSUMED_RAY_SHARE * width, rms)
        rows = tuple(map(tuple, _assumed_covariance(model, ray_px).tolist()))
        remarks.append(
            f"it has no covariance: each ray is assumed known to {ray_px:.2f} px "
            "(standard deviation); `scm eye calibrate` measures it"
        )
        return msgspec.structs.replace(made, covariance=rows), tuple(remarks)

    def _five(
        self, numbers: Floats, focal: Mapping[str, float], size: tuple[int, int], remarks: list[str]
    ) -> tuple[LensKind, Five]:
        """Return the kind of the lens and its five distortion coefficients."""
        if self._is_fisheye():
            if 0 < len(numbers) < 4 or np.any(numbers[4:]):
                raise self._fault("distortion coefficients", "4 of a fisheye", f"{len(numbers)}")
            k1, k2, k3, k4 = (numbers if len(numbers) else np.zeros(4))[:4].tolist()
            return "fisheye", (k1, k2, k3, k4, 0.0)
        if len(numbers) not in (0, 4, 5, 8, 12, 14):
            raise self._fault("distortion coefficients", "4, 5, 8, 12 or 14", f"{len(numbers)}")
        padded = np.pad(numbers, (0, max(0, 5 - len(numbers))))
        k1, k2, p1, p2, k3 = padded[:5].tolist()
        if not np.any(padded[5:]):
            return "pinhole", (k1, k2, p1, p2, k3)
        five, left = _fitted_by_five(padded, focal, size)
        if not left <= RMS_SHARE * size[0]:
            raise self._fault(
                "distortion coefficients",
                f"a lens that five of them follow to {RMS_SHARE * size[0]:.2f} px RMS (calibrate "
                "again without the rational model, or as a fisheye)",
                f"{len(numbers)} of them, {left:.2f} px RMS left",
            )
        remarks.append(
            f"its {len(numbers)} distortion coefficients are approximated by five: residual "
            f"{left:.3f} px RMS"
        )
        k1, k2, p1, p2, k3 = five.tolist()
        return "pinhole", (k1, k2, p1, p2, k3)

    def _frame_size(self, size_px: tuple[int, int] | None, remarks: list[str]) -> tuple[int, int]:
        pair = self._numbers(_SIZE)
        found = [self._number(_WIDTH, 0.0), self._number(_HEIGHT, 0.0)]
        if not all(found) and len(pair) == 2:
            found = pair.tolist()
        if all(found):
            return int(found[0]), int(found[1])
        if size_px is None:
            raise self._fault("image_width and image_height", "the frame's size", "none")
        remarks.append(
            f"it has no frame size: assumed to be the camera's, {size_px[0]} x {size_px[1]}"
        )
        return size_px

    def _focal(self, width: int) -> tuple[float, float, float, float]:
        numbers = self._numbers(_MATRIX)
        if len(numbers) == 4:
            numbers = np.array([numbers[0], 0, numbers[2], 0, numbers[1], numbers[3], 0, 0, 1])
        if len(numbers) != 9:
            got = f"{len(numbers)} numbers" if len(numbers) else f"keys {self._keys}"
            raise self._fault("camera_matrix", "nine numbers, row by row", got)
        fx, skew, cx, zero, fy, cy, *last = numbers.tolist()
        is_matrix = zero == 0.0 and last == [0.0, 0.0, 1.0] and fx > 0.0 and fy > 0.0
        if not is_matrix or not abs(skew) <= MAX_SKEW_SHARE * width:
            raise self._fault(
                "camera_matrix", "[fx, 0, cx, 0, fy, cy, 0, 0, 1] of a calibrated camera",
                f"{numbers.tolist()}",
            )  # fmt: skip
        return fx, fy, cx, cy

    def _coefficients(self) -> Floats:
        name = _plain(str(self._get(("distortionmodel",)) or ""))
        if name not in (*_BROWN, *_FISHEYE):
            raise self._fault(
                "distortion_model", "plumb_bob, rational_polynomial or equidistant", name
            )
        return self._numbers(_COEFFICIENTS)

    def _is_fisheye(self) -> bool:
        name = _plain(str(self._get(("distortionmodel",)) or ""))
        return name in _FISHEYE or bool(self._number(("fisheyemodel", "fisheye"), 0.0))

    def _number(self, names: Sequence[str], default: float) -> float:
        numbers = self._numbers(names)
        return float(numbers[0]) if len(numbers) else default

    def _numbers(self, names: Sequence[str]) -> Floats:
        """Return the numbers of the first name present, row by row, (n,); if none, (0,)."""
        value = self._get(names)
        if isinstance(value, dict):
            value = value.get("data")
        if value is None:
            return np.zeros(0)
        try:  # YAML reads 1e-05 as text
            numbers = np.array(value).astype(np.float64).reshape(-1)
        except (TypeError, ValueError) as error:
            raise self._fault(names[0], "numbers", f"{str(value)[:60]!r}") from error
        if not np.isfinite(numbers).all():
            raise self._fault(names[0], "finite numbers", f"{numbers.tolist()}")
        return numbers

    def _get(self, names: Sequence[str]) -> Any:
        return next((self._read[name] for name in names if name in self._read), None)

    def _fault(self, key: str, expected: str, got: str) -> EyeError:
        return EyeError(f"{self._path}: {key}: expected {expected}, got {got}")


def _plain(key: str) -> str:
    return "".join(one for one in key.lower() if one.isalnum())


def _grid(size: tuple[int, int]) -> Floats:
    """Return pixels spread evenly over a frame, (GRID^2, 2)."""
    across, down = (np.linspace(0.0, edge - 1.0, GRID) for edge in size)
    return np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)


def _fitted_by_five(
    numbers: Floats, focal: Mapping[str, float], size: tuple[int, int]
) -> tuple[Floats, float]:
    """Return five coefficients that approximate these, and the residual [px RMS]."""
    fx, fy, cx, cy = (focal[name] for name in ("fx_px", "fy_px", "cx_px", "cy_px"))
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 400, 1e-12)
    pixels = _grid(size)
    rays = cv2.undistortPoints(pixels[:, None], matrix, numbers, None, None, None, until)[:, 0]
    if not np.isfinite(rays).all():
        return np.zeros(5), math.inf
    flat = np.concatenate((rays, np.ones((len(rays), 1))), axis=1)
    zero = np.zeros(3)
    bent = cv2.projectPoints(flat, zero, zero, matrix, numbers)[0][:, 0]
    a, b = rays.T
    r2 = a * a + b * b
    columns = [
        (a * r2, b * r2), (a * r2**2, b * r2**2), (2.0 * a * b, r2 + 2.0 * b * b),
        (r2 + 2.0 * a * a, 2.0 * a * b), (a * r2**3, b * r2**3),
    ]  # fmt: skip
    slopes = np.array([np.concatenate((fx * x, fy * y)) for x, y in columns]).T
    straight = np.concatenate((fx * a + cx, fy * b + cy))
    five = np.linalg.lstsq(slopes, np.concatenate(bent.T) - straight, rcond=None)[0]
    off = straight + slopes @ five - np.concatenate(pixels.T)
    return five, float(np.sqrt(2.0 * np.mean(off**2)))


def _assumed_covariance(model: CameraModel, ray_px: float) -> Floats:
    """Return the covariance of a lens, (9, 9), that gives this mean ray std."""
    camera = model.camera
    known = sum(name != "none" for name in LENS_NAMES[camera.lens])
    pixels = _grid((camera.width_px, camera.height_px))
    rays = model.undistort(pixels)
    rays = rays[np.isfinite(rays).all(axis=-1)]
    flat = np.concatenate((rays, np.ones((len(rays), 1))), axis=1)
    steps = STEPS[-LENS_PARAMETERS:]
    at = parameters(model)[-LENS_PARAMETERS:]
    slopes = np.empty((2 * len(rays), known))
    for index in range(known):
        step = np.zeros(LENS_PARAMETERS)
        step[index] = steps[index]
        up, down = (_seen(flat, camera.lens, at + sign * step) for sign in (1.0, -1.0))
        slopes[:, index] = (up - down).ravel() / (2.0 * steps[index])
    scale = np.sqrt((slopes**2).sum(axis=0))
    inverse = np.linalg.inv((slopes / scale).T @ (slopes / scale)) / np.outer(scale, scale)
    covariance = np.zeros((LENS_PARAMETERS, LENS_PARAMETERS))
    covariance[:known, :known] = ray_px**2 * len(slopes) / known * inverse
    return (covariance + covariance.T) / 2.0


def _seen(rays: Floats, lens: str, values: Floats) -> Floats:
    """Return where a lens with these nine parameters projects rays, (n, 3) to (n, 2) [px]."""
    fx, fy, cx, cy = values[:4]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    zero = np.zeros(3)
    if lens == "fisheye":
        seen = cv2.fisheye.projectPoints(rays[:, None], zero, zero, matrix, values[4:8])[0][:, 0]
    else:
        seen = cv2.projectPoints(rays, zero, zero, matrix, values[4:9])[0][:, 0]
    return np.asarray(seen, dtype=np.float64)


def write_calibration(
    calibration: Calibration, path: Path, form: Format, name: str = "camera"
) -> None:
    """Write a lens for another program: ROS' camera_info YAML or OpenCV's YAML; or as our own TOML.

    ROS and OpenCV cannot store the covariance; only our own file contains it.

    Raises:
        EyeError: The file cannot be written.
    """
    write: Mapping[Format, Callable[[], str]] = {
        "ros": lambda: _as_ros(calibration, name),
        "opencv": lambda: _as_opencv(calibration),
    }
    try:
        if form == "scm":
            calibration.save(path)
        else:
            path.write_text(write[form](), encoding="utf-8")
    except OSError as error:
        raise EyeError(f"{path}: cannot be written: {error.strerror}") from error


def _distortion(calibration: Calibration) -> list[float]:
    return list(calibration.distortion[: 4 if calibration.lens == "fisheye" else 5])


def _as_ros(calibration: Calibration, name: str) -> str:
    one = calibration
    numbers = _distortion(one)
    model = "equidistant" if one.lens == "fisheye" else "plumb_bob"
    k = [one.fx_px, 0.0, one.cx_px, 0.0, one.fy_px, one.cy_px, 0.0, 0.0, 1.0]
    p = [*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0]
    matrices = (
        ("camera_matrix", 3, 3, k),
        ("rectification_matrix", 3, 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        ("projection_matrix", 3, 4, p),
    )
    lines = [
        f"image_width: {one.width_px}", f"image_height: {one.height_px}", f"camera_name: {name}",
        f"distortion_model: {model}",
        *_ros_matrix("distortion_coefficients", 1, len(numbers), numbers),
        *(line for matrix in matrices for line in _ros_matrix(*matrix)),
    ]  # fmt: skip
    return "\n".join((*lines, ""))


def _ros_matrix(name: str, rows: int, columns: int, data: Sequence[float]) -> list[str]:
    return [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{_numbers(data)}]"]


def _as_opencv(calibration: Calibration) -> str:
    one = calibration
    k = [one.fx_px, 0.0, one.cx_px, 0.0, one.fy_px, one.cy_px, 0.0, 0.0, 1.0]
    numbers = _distortion(one)
    matrices = ("camera_matrix", 3, 3, k), ("distortion_coefficients", len(numbers), 1, numbers)
    lines = [
        "%YAML:1.0", "---", f"image_width: {one.width_px}", f"image_height: {one.height_px}",
        f"fisheye_model: {int(one.lens == 'fisheye')}",
        *(line for matrix in matrices for line in _opencv_matrix(*matrix)),
        f"avg_reprojection_error: {one.rms_px!r}", f"nr_of_frames: {one.views}",
    ]  # fmt: skip
    return "\n".join((*lines, ""))


def _opencv_matrix(name: str, rows: int, columns: int, data: Sequence[float]) -> list[str]:
    head = [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}", "   dt: d"]
    return [*head, f"   data: [ {_numbers(data)} ]"]


def _numbers(values: Sequence[float]) -> str:
    """Return numbers that YAML reads as numbers: with a point even before an exponent."""
    texts = (repr(float(value)) for value in values)
    return ", ".join(one if "." in one else one.replace("e", ".0e") for one in texts)
