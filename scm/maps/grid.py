"""A scanned grid as ROS map_server saves it: a `.yaml` that names a grey picture.

What a cell's grey means is the yaml's to say (`mode`, `negate`, two thresholds), by the rules of
ROS 2's `nav2_map_server`, with two exceptions that its own maps need. In mode `trinary` grey 205 is
never free: map savers write 205 for unknown, beside a `free_thresh` of 0.25 that calls it free. And
a cell that is not opaque is unknown in every mode; it is not averaged with the colours.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from reprlib import repr as short
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.errors import MapError, nearest
from scm.geometry import TAU, Pose2
from scm.maps.grey import read_picture
from scm.yaml_file import read_yaml

MAX_CELLS = 25_000_000  # loading them takes 9 s and some 500 MB
CELL_M = (1e-4, 100.0)
MAX_M = 1e6  # from the origin: further away a coordinate no longer resolves a cell
UNKNOWN_GREY = 205  # of 255; what map savers write
RAW_OCCUPIED = 100  # mode raw: 0 to 100 are per cent, all above is unknown

Mode = Literal["trinary", "scale", "raw"]
_REQUIRED = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
_OPTIONAL = ("negate", "mode")
_TRUTH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
_UNKNOWN, _FREE, _OCCUPIED, _SAVED_UNKNOWN = range(4)


@dataclass(frozen=True)
class OccupancyGrid:
    """Square cells, each free, occupied, or (neither) unknown.

    Attributes:
        name: The file's, without its ending.
        free: Shape (rows, columns); row 0 is the lowest, column 0 the leftmost.
        occupied: Shape (rows, columns), as `free`.
        cell_m: Edge of a cell.
        origin: Lower left corner of cell (0, 0) in the map frame.
        notes: How cells were read that the thresholds alone would read otherwise, as sentences.
    """

    name: str
    free: Bools
    occupied: Bools
    cell_m: float
    origin: Pose2
    notes: tuple[str, ...] = ()

    def cell_at(self, x: float, y: float) -> tuple[int, int]:
        """Return row and column of the cell that holds a point [m]; it may lie outside."""
        across, up = self.origin.inverse().apply(x, y)
        return math.floor(up / self.cell_m), math.floor(across / self.cell_m)


class _Description(NamedTuple):
    """What a map_server `.yaml` says."""

    image: Path
    mode: Mode
    cell_m: float
    origin: Pose2
    negate: bool
    free_thresh: float
    occupied_thresh: float
    unused: tuple[str, ...]


def load_occupancy(yaml_path: str | Path) -> OccupancyGrid:
    """Return the grid that a map_server `.yaml` describes.

    Raises:
        MapError: The description or its picture is missing or wrong; it names the `.yaml`.
    """
    path = Path(yaml_path)
    description = _read_description(path)
    try:
        pixels = read_picture(description.image, MAX_CELLS)
    except MapError as error:
        raise MapError(f"{path}: image: {error}{_hint(path, description.image)}") from error
    states, notes = _states(pixels, description)
    if description.unused:
        notes.append(f"keys that mean nothing here: {', '.join(description.unused)}")
    upward = states[::-1]
    return OccupancyGrid(
        name=path.stem,
        free=upward == _FREE,
        occupied=upward == _OCCUPIED,
        cell_m=description.cell_m,
        origin=description.origin,
        notes=tuple(notes),
    )


def _hint(path: Path, image: Path) -> str:
    """Return where the picture may be instead of where the description says."""
    name = PureWindowsPath(image).name  # takes both kinds of slash
    beside = path.parent / name
    if image == beside or not name or not beside.is_file():
        return ""
    return f"; {name} lies beside {path.name}: write `image: {name}`"


def _states(pixels: NDArray[Any], description: _Description) -> tuple[NDArray[np.uint8], list[str]]:
    """Return what each cell is, from the top row down, and notes on it."""
    white = np.iinfo(pixels.dtype).max
    channels = 1 if pixels.ndim == 2 else 3
    brightness = pixels
    if pixels.ndim == 3:
        brightness = pixels[:, :, :channels].sum(axis=2, dtype=np.uint32)
    states = _meaning(description, channels * white)[brightness]
    notes = []
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        is_clear = pixels[:, :, 3] < white
        states[is_clear] = _UNKNOWN
        if count := int(is_clear.sum()):
            notes.append(f"{count} cells that are not opaque are unknown")
    if count := int((states == _SAVED_UNKNOWN).sum()):
        notes.append(
            f"{count} cells of grey {UNKNOWN_GREY} are unknown, as map savers write them, though "
            f"free_thresh {description.free_thresh:g} calls them free"
        )
    return states, notes


def _meaning(description: _Description, white: int) -> NDArray[np.uint8]:
    """Return the state of a cell for each brightness from 0 to white."""
    shade: Floats = np.arange(white + 1) / white
    occupancy = shade if description.negate else 1.0 - shade
    known = np.ones(white + 1, np.bool_)
    if description.mode == "raw":
        per_cent = np.rint(shade * 255.0)
        occupancy, known = per_cent / RAW_OCCUPIED, per_cent <= RAW_OCCUPIED
    states = np.full(white + 1, _UNKNOWN, np.uint8)
    states[known & (occupancy < description.free_thresh)] = _FREE
    states[known & (occupancy > description.occupied_thresh)] = _OCCUPIED
    if description.mode == "trinary":
        is_205 = np.abs((1.0 - occupancy) * 255.0 - UNKNOWN_GREY) < 0.5
        states[is_205 & (states == _FREE)] = _SAVED_UNKNOWN
    return states


def _read_description(path: Path) -> _Description:
    info = read_yaml(path, MapError)
    if not isinstance(info, dict):
        raise MapError(f"{path}: expected keys {', '.join(_REQUIRED)}, got {type(info).__name__}")
    unused = sorted({str(key) for key in info} - {*_REQUIRED, *_OPTIONAL})
    missing = [key for key in _REQUIRED if key not in info]
    if missing:
        meant = "".join(f"; got {key}{nearest(key, missing)}" for key in unused)
        raise MapError(
            f"{path}: key {', '.join(missing)} is missing: expected a scanned map{meant}"
        )
    read = _Reader(path, info)
    free, occupied = (read.number(key, 0.0, 1.0) for key in ("free_thresh", "occupied_thresh"))
    if free > occupied:
        raise read.refusal("free_thresh", f"at most occupied_thresh ({occupied:g})", free)
    mode, negate = read.mode(), read.truth("negate")
    if mode == "raw" and negate:
        raise read.refusal("negate", "0 in mode raw, where ROS 1 and ROS 2 differ on it", negate)
    return _Description(
        image=path.parent / read.image(),
        mode=mode,
        cell_m=read.number("resolution", *CELL_M),
        origin=read.origin(),
        negate=negate,
        free_thresh=free,
        occupied_thresh=occupied,
        unused=tuple(unused),
    )


class _Reader(NamedTuple):
    """Reads values by what they mean, whatever way YAML or a program wrote them."""

    path: Path
    info: Mapping[Any, Any]

    def refusal(self, key: str, expected: str, got: object) -> MapError:
        return MapError(f"{self.path}: {key}: expected {expected}, got {short(got)}")

    def number(self, key: str, low: float, high: float) -> float:
        return self._number(key, self.info[key], low, high)

    def _number(self, key: str, value: object, low: float, high: float, unit: str = "") -> float:
        number = _as_number(value)
        if number is None:
            raise self.refusal(key, "a finite number", value)
        if not low <= number <= high:
            raise self.refusal(key, f"{low:g} to {high:g}{unit}", value)
        return number

    def truth(self, key: str) -> bool:
        value = self.info.get(key, False)
        if isinstance(value, bool):
            return value
        number = _as_number(value)
        truth = bool(number) if number in {0.0, 1.0} else _TRUTH.get(str(value).strip().lower())
        if truth is None:
            raise self.refusal(key, "0 or 1", value)
        return truth

    def mode(self) -> Mode:
        value = self.info.get("mode", "trinary")
        name = value.strip().lower() if isinstance(value, str) else value
        for mode in get_args(Mode):
            if name == mode:
                return mode  # type: ignore[no-any-return]
        raise self.refusal("mode", ", ".join(get_args(Mode)), value)

    def image(self) -> str:
        value = self.info["image"]
        if isinstance(value, bool) or not isinstance(value, str | int) or not str(value).strip():
            raise self.refusal("image", "the name of a picture file", value)
        return str(value).strip()

    def origin(self) -> Pose2:
        value = self.info["origin"]
        items = re.split(r"[\s,;]+", value.strip("[]() ")) if isinstance(value, str) else value
        if not isinstance(items, list) or len(items) != 3:
            raise self.refusal("origin", "[x, y, yaw]", value)
        x, y = (self._number(f"origin[{i}]", items[i], -MAX_M, MAX_M, " m") for i in (0, 1))
        return Pose2(x, y, self._number("origin[2]", items[2], -TAU, TAU, " rad"))


def _as_number(value: object) -> float | None:
    """Return a finite number, also one that stands in quotes or as YAML 1.1 does not know it."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
