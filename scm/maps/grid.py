"""A scanned grid as ROS map_server saves it: a `.yaml` that names a grey `.pgm` picture."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.errors import MapError, reading
from scm.geometry import Pose2

_REQUIRED = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
_PGM_HEADER = re.compile(rb"(P[25])" + rb"(?:\s|#[^\n]*\n)+(\d+)" * 3 + rb"\s")


@dataclass(frozen=True)
class OccupancyGrid:
    """Square cells, each free, occupied, or (neither) unknown.

    Attributes:
        name: The file's, without its ending.
        free: Shape (rows, columns); row 0 is the lowest, column 0 the leftmost.
        occupied: Shape (rows, columns), as `free`.
        cell_m: Edge of a cell.
        origin: Lower left corner of cell (0, 0) in the map frame.
    """

    name: str
    free: Bools
    occupied: Bools
    cell_m: float
    origin: Pose2

    def is_free(self, x: float, y: float) -> bool:
        """Return whether a point [m] lies in a cell that was seen empty."""
        across, up = self.origin.inverse().apply(x, y)
        row, column = math.floor(up / self.cell_m), math.floor(across / self.cell_m)
        rows, columns = self.free.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self.free[row, column])


def load_occupancy(yaml_path: str | Path) -> OccupancyGrid:
    """Return the grid that a map_server `.yaml` describes.

    Raises:
        MapError: The description or its picture is missing or wrong.
    """
    path = Path(yaml_path)
    info = _read_description(path)
    cell_m = _number(path, "resolution", info["resolution"])
    if cell_m <= 0.0:
        raise MapError(f"{path}: resolution: expected more than 0, got {cell_m}")
    origin = info["origin"]
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapError(f"{path}: origin: expected [x, y, yaw], got {origin!r}")
    corner = Pose2(*(_number(path, f"origin[{i}]", value) for i, value in enumerate(origin)))
    grey = _grey(path.parent / str(info["image"]))
    taken = grey if info.get("negate", 0) else 1.0 - grey
    upward = taken[::-1]
    return OccupancyGrid(
        name=path.stem,
        free=upward < _number(path, "free_thresh", info["free_thresh"]),
        occupied=upward > _number(path, "occupied_thresh", info["occupied_thresh"]),
        cell_m=cell_m,
        origin=corner,
    )


def _read_description(path: Path) -> dict[str, Any]:
    with reading(path, "a YAML file", MapError):
        info = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(info, dict):
        raise MapError(f"{path}: expected keys {', '.join(_REQUIRED)}, got {type(info).__name__}")
    missing = [key for key in _REQUIRED if key not in info]
    if missing:
        raise MapError(f"{path}: key {', '.join(missing)} is missing: expected a scanned map")
    mode = info.get("mode", "trinary")
    if mode != "trinary":
        raise MapError(f"{path}: mode: expected trinary, got {mode!r}")
    return info


def _number(path: Path, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise MapError(f"{path}: {key}: expected a finite number, got {value!r}")
    return float(value)


def _grey(path: Path) -> Floats:
    """Return a picture's grey, 0 black to 1 white, from the top."""
    pixels = read_pgm(path)
    return np.asarray(pixels / np.iinfo(pixels.dtype).max, dtype=np.float64)


def read_pgm(path: Path) -> NDArray[Any]:
    """Return a grey picture, shape (rows, columns) from the top, white at the type's full scale.

    Raises:
        MapError: The file is missing, or no PGM picture.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error}") from error
    header = _PGM_HEADER.match(data)
    if header is None:
        raise MapError(f"{path}: expected a PGM picture (P2 or P5), got {data[:8]!r}")
    width, height, top = (int(header[i]) for i in (2, 3, 4))
    if not 0 < top < 65536:
        raise MapError(f"{path}: expected a largest grey value of 1 to 65535, got {top}")
    body = data[header.end() :]
    depth = np.dtype(">u2") if top > 255 else np.dtype("u1")
    if header[1] == b"P2":
        words = [min(int(word), top) for word in body.split() if word.isdigit()]
        body = np.array(words, depth).tobytes()
    if len(body) < width * height * depth.itemsize:
        got = len(body) // depth.itemsize
        raise MapError(f"{path}: expected {width} x {height} pixels, got {got}")
    pixels: NDArray[Any] = np.frombuffer(body, depth, width * height).reshape(height, width)
    full = 65535 if top > 255 else 255
    scaled: NDArray[Any] = np.rint(pixels * (full / top)).astype(depth.newbyteorder("="))
    return scaled
