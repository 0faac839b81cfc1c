"""The frames of a real camera, read from a folder."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from scm.arrays import Image, Ints
from scm.errors import EyeError

JPEG, PNG = (".jpg", ".jpeg"), (".png",)
LEAST, MOST = 8, 40
"""Frames that are needed, and those that are used of more: evenly over the folder."""
DARKEST, BRIGHTEST = 6.0, 249.0
LEAST_COLOUR = 0.5
_TABLE = b"\xff\xdb"
_ENTRIES = 64


@dataclass(frozen=True, slots=True)
class RealFrames:
    """Frames of one camera.

    Attributes:
        folder: Where they are.
        count: How many there are.
        images: Those that are used, (n, height, width, 3), blue first.
        jpeg_quality: Of their files; None: they are not compressed.
    """

    folder: Path
    count: int
    images: Image
    jpeg_quality: int | None


def read_frames(folder: Path, size_px: tuple[int, int]) -> RealFrames:
    """Read a folder of JPEG or PNG files.

    Args:
        folder: Where they are.
        size_px: Width and height of the camera's frames; they may have been made smaller.

    Raises:
        EyeError: naming what is wrong with the folder or a file.
    """
    paths = sorted(p for p in _entries(folder) if p.suffix.lower() in (*JPEG, *PNG))
    kinds = {path.suffix.lower() in JPEG for path in paths}
    if len(paths) < LEAST:
        msg = f"{folder}: expected at least {LEAST} frames (.jpg, .png), got {len(paths)}"
        raise EyeError(msg)
    if len(kinds) > 1:
        raise EyeError(f"{folder}: expected frames of one kind, got both JPEG and PNG")
    used = [
        paths[i] for i in np.linspace(0, len(paths) - 1, min(MOST, len(paths))).round().astype(int)
    ]
    images = [_read(path) for path in used]
    for path, image in zip(used, images, strict=True):
        _check_size(path, image.shape[1::-1], images[0].shape[1::-1], size_px)
    stacked = np.stack(images)
    _check_light(folder, stacked)
    quality = round(float(np.median([_quality(path) for path in used]))) if True in kinds else None
    return RealFrames(folder, len(paths), stacked, quality)


def _entries(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise EyeError(f"{folder}: expected a folder of frames (.jpg, .png), got no such folder")
    return list(folder.iterdir())


def _read(path: Path) -> Image:
    image = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise EyeError(f"{path}: expected a JPEG or PNG picture, got a file that is none")
    return np.asarray(image, dtype=np.uint8)


def _check_size(
    path: Path, got: tuple[int, ...], first: tuple[int, ...], size_px: tuple[int, int]
) -> None:
    """Refuse a frame that another camera took, or another setting of it."""
    width, height = size_px
    scale = got[0] / width
    if got != first or scale > 1.0 or abs(got[1] - scale * height) > 1.0:
        expected = " x ".join(map(str, first if got != first else size_px))
        more = "" if got != first else ", the car file's, or smaller in the same shape"
        raise EyeError(f"{path}: expected {expected} pixels{more}, got {got[0]} x {got[1]}")


def _check_light(folder: Path, images: Image) -> None:
    """Refuse frames of which nothing can be measured."""
    some = images[:, ::4, ::4].astype(np.float32)
    bright = float(np.percentile(some, 90))
    if bright < DARKEST:
        msg = f"{folder}: black: nine in ten pixels are darker than {bright:.0f} of 255"
        raise EyeError(f"{msg}, expected lit frames")
    if float(np.percentile(some, 10)) > BRIGHTEST:
        raise EyeError(f"{folder}: white: over-exposed, expected frames that are not saturated")
    if float((some.max(axis=3) - some.min(axis=3)).mean()) < LEAST_COLOUR:
        raise EyeError(f"{folder}: grey: red, green and blue are equal, expected a colour camera")


def _quality(path: Path) -> int:
    """Return the quality from 1 to 100 whose table a JPEG file has, or the nearest to it."""
    given = _luminance_table(path.read_bytes())
    off = [int(np.abs(given - table).sum()) for table in _tables()]
    return 1 + int(np.argmin(off))


@cache
def _tables() -> list[Ints]:
    pixel = np.zeros((8, 8, 3), np.uint8)
    made = (cv2.imencode(".jpg", pixel, [cv2.IMWRITE_JPEG_QUALITY, q])[1] for q in range(1, 101))
    return [_luminance_table(one.tobytes()) for one in made]


def _luminance_table(data: bytes) -> Ints:
    """Return the first quantisation table of a JPEG file, (64,)."""
    at = data.find(_TABLE) + len(_TABLE) + 3
    return np.frombuffer(data[at : at + _ENTRIES].ljust(_ENTRIES, b"\0"), np.uint8).astype(np.int64)
