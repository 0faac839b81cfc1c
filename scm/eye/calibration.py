"""A lens measured by `scm eye calibrate`: a small file, and the camera with this lens."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.camera import LENS_PARAMETERS
from scm.records.city_map import Camera
from scm.records.floor import Record

LENS_NAMES = {
    "pinhole": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"),
    "fisheye": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "none"),
}
"""Names of a lens's nine parameters, in the order of its covariance."""


class Calibration(Record, kw_only=True, frozen=True):
    """One lens at one frame size.

    Attributes:
        distortion: k1, k2, p1, p2, k3; of a fisheye k1, k2, k3, k4, 0.
        covariance: Of fx, fy, cx, cy and the distortion, nine rows of nine; zeros for a term that
            was left out.
        rms_px: RMS residual at the board's points, per point.
        views: Number of pictures of the board that were used.
    """

    lens: Literal["pinhole", "fisheye"]
    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float]
    covariance: tuple[tuple[float, ...], ...]
    rms_px: float
    views: int

    @property
    def values(self) -> Floats:
        """The nine parameters of the lens, (9,)."""
        return np.array([self.fx_px, self.fy_px, self.cx_px, self.cy_px, *self.distortion])

    @property
    def lens_covariance(self) -> Floats:
        """Covariance of the lens, for `camera_model`, (9, 9)."""
        return np.array(self.covariance)

    @property
    def deviations(self) -> Floats:
        """Standard deviations of the nine parameters, (9,)."""
        deviations: Floats = np.sqrt(np.diag(self.lens_covariance))
        return deviations

    def camera(self, name: str = "lens") -> Camera:
        """Return a camera with this lens, 1 m above the origin and looking straight down."""
        size = {"width_px": self.width_px, "height_px": self.height_px}
        focal = {"fx_px": self.fx_px, "fy_px": self.fy_px}
        middle = {"cx_px": self.cx_px, "cy_px": self.cy_px}
        place = {"x_m": 0.0, "y_m": 0.0, "z_m": 1.0}
        return msgspec.convert(
            {"name": name, "lens": self.lens, "distortion": self.distortion}
            | size | focal | middle | place,
            Camera,
        )  # fmt: skip

    def save(self, path: Path) -> None:
        """Write it as a TOML file."""
        rows = "\n".join(f"    [{_numbers(row)}]," for row in self.covariance)
        path.write_text(
            "# A lens, measured by `scm eye calibrate`.\n"
            f'lens = "{self.lens}"\nwidth_px = {self.width_px}\nheight_px = {self.height_px}\n'
            f"fx_px = {self.fx_px!r}\nfy_px = {self.fy_px!r}\n"
            f"cx_px = {self.cx_px!r}\ncy_px = {self.cy_px!r}\n"
            f"distortion = [{_numbers(self.distortion)}]\n"
            f"rms_px = {self.rms_px!r}\nviews = {self.views}\n"
            f"# of {', '.join(LENS_NAMES[self.lens])}\ncovariance = [\n{rows}\n]\n",
            encoding="utf-8",
        )


def calibrated(camera: Camera, calibration: Calibration) -> Camera:
    """Return a camera of a map file with a measured lens instead of its own.

    Raises:
        EyeError: The lens was measured at another frame size.
    """
    has = f"{camera.width_px} x {camera.height_px}"
    got = f"{calibration.width_px} x {calibration.height_px}"
    if has != got:
        raise EyeError(
            f"camera {camera.name!r}: expected a calibration for frames of {has} px, got one of "
            f"{got} px; calibrate at the size the camera runs at"
        )
    return msgspec.structs.replace(
        camera,
        lens=calibration.lens,
        fx_px=calibration.fx_px,
        fy_px=calibration.fy_px,
        cx_px=calibration.cx_px,
        cy_px=calibration.cy_px,
        distortion=calibration.distortion,
    )


def _numbers(row: tuple[float, ...]) -> str:
    return ", ".join(repr(float(value)) for value in row)


def covariance_faults(rows: Sequence[Sequence[float]]) -> str:
    """Return why rows are no covariance of a lens; empty if they are one."""
    if len(rows) != LENS_PARAMETERS or any(len(row) != LENS_PARAMETERS for row in rows):
        return f"expected nine rows of nine, got {len(rows)} of {sorted({len(r) for r in rows})}"
    matrix = np.array(rows)
    size = np.sqrt(np.abs(np.diag(matrix)))
    scaled = matrix / np.maximum(np.outer(size, size), 1e-300)
    if not np.isfinite(matrix).all() or not np.allclose(scaled, scaled.T, atol=1e-6):
        return "expected a symmetric matrix of numbers"
    if np.linalg.eigvalsh(scaled).min() < -1e-6:
        return "expected no negative variance in any direction"
    return ""
