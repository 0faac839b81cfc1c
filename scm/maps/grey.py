"""Reads pictures: PGM and PPM here, every other format by OpenCV, and NPY arrays for a floor.

OpenCV is loaded with the first picture: most programs that know a map never read one.
"""

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.errors import MapError, reading
from scm.records.floor import Samples

MAX_FLOOR_PIXELS = 4_000_000
KINDS = {"uint8": "<u1", "uint16": "<u2", "float32": "<f4"}

_PNG = b"\x89PNG\r\n\x1a\n"
_SPACE = rb"(?:\s|#[^\n]*\n)+"
_BITMAP = re.compile(rb"P[14]" + (_SPACE + rb"(\d{1,9})") * 2)
_PNM = re.compile(rb"P([2356])" + (_SPACE + rb"(\d{1,9})") * 3 + rb"(?:\r\n|\s)")


def read_picture(path: Path, max_pixels: int) -> NDArray[Any]:
    """Return the pixels of a picture, `uint8` or `uint16`, white at the type's full scale.

    Args:
        path: A file in any format that OpenCV reads: PNG, PGM, BMP, TIFF, JPEG and others.
        max_pixels: A larger picture is refused, before it is unpacked where its header says so.

    Returns:
        Shape (rows, columns) of a grey one, else (rows, columns, channels): three colours, then
        opacity if it has four. Row 0 is the top.

    Raises:
        MapError: The file is missing, damaged, too large, or no picture of 8 or 16 bits a channel.
    """
    with reading(path, "a picture", MapError):
        if path.is_dir():
            raise MapError(f"{path}: expected a picture, got a folder")
        if not path.is_file():
            raise MapError(f"{path}: there is no such picture")
        data = path.read_bytes()
    _check_size(path, *_declared_size(data), max_pixels)
    header = _PNM.match(data)
    pixels = _decoded(path, data) if header is None else _anymap(path, data, header)
    if pixels.dtype.name not in {"uint8", "uint16"}:
        raise MapError(f"{path}: expected 8 or 16 bits a channel, got {pixels.dtype}")
    _check_size(path, pixels.shape[1], pixels.shape[0], max_pixels)
    return pixels


def _declared_size(data: bytes) -> tuple[int, int]:
    """Return width and height as the header says them; 0, 0 for formats not looked into."""
    if data.startswith(_PNG) and len(data) >= 24:
        width, height = struct.unpack(">II", data[16:24])
        return width, height
    if header := _PNM.match(data):
        return int(header[2]), int(header[3])
    if header := _BITMAP.match(data):
        return int(header[1]), int(header[2])
    return 0, 0


def _check_size(path: Path, width: int, height: int, max_pixels: int) -> None:
    if width * height > max_pixels:
        raise MapError(
            f"{path}: expected at most {max_pixels} pixels, got {width} x {height}: crop the "
            "picture, or save it at a coarser resolution"
        )


def _anymap(path: Path, data: bytes, header: re.Match[bytes]) -> NDArray[Any]:
    """Return the pixels of a PGM or PPM picture, text or binary.

    OpenCV leaves binary values as they are whatever the header says is white.
    """
    width, height, white = (int(header[i]) for i in (2, 3, 4))
    if not 0 < white < 65536:
        raise MapError(f"{path}: expected a largest grey value of 1 to 65535, got {white}")
    depth = np.dtype(">u2") if white > 255 else np.dtype("u1")
    channels = 3 if header[1] in b"36" else 1
    count = width * height * channels
    if header[1] in b"23":
        values = _numbers(path, data[header.end() :])
    else:
        whole = (len(data) - header.end()) // depth.itemsize
        values = np.frombuffer(data, depth, min(count, whole), header.end())
    if len(values) < count or not count:
        raise MapError(f"{path}: expected {width} x {height} pixels, got {len(values) // channels}")
    values = values[:count]
    if int(values.max()) > white or int(values.min()) < 0:
        got = int(values.max()) if values.max() > white else int(values.min())
        raise MapError(f"{path}: expected grey values of 0 to {white}, got {got}")
    full = 65535 if white > 255 else 255
    if white != full:
        values = (values.astype(np.uint32) * full + white // 2) // white
    pixels = values.astype(np.uint16 if white > 255 else np.uint8)
    return pixels.reshape((height, width) if channels == 1 else (height, width, channels))


def _numbers(path: Path, text: bytes) -> NDArray[Any]:
    """Return the whole numbers of a text, without its comments."""
    with reading(path, "a picture", MapError, "its pixels must be whole numbers"):
        words = re.sub(rb"#[^\n]*", b"", text).decode("ascii")
        if re.search(r"[^\d\s]", words):
            raise ValueError("a pixel is no number")
        return np.fromstring(words if words.strip() else "", np.int64, sep=" ")


def _decoded(path: Path, data: bytes) -> NDArray[Any]:
    """Return the pixels of a picture that OpenCV unpacks."""
    import cv2  # noqa: PLC0415  see above

    log = cv2.utils.logging
    level = log.getLogLevel()
    log.setLogLevel(log.LOG_LEVEL_SILENT)  # it would write to the terminal beside our error
    try:
        buffer = np.frombuffer(data, np.uint8)
        pixels = cv2.imdecode(buffer, cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error:  # a size that it refuses
        pixels = None
    finally:
        log.setLogLevel(level)
    if pixels is None:
        raise MapError(
            f"{path}: expected a picture such as PNG or PGM that is whole, got one that cannot be "
            f"read and begins with {data[:8]!r}: save it anew"
        )
    return np.asarray(pixels)


def read_grey(path: Path) -> Samples:
    """Return the grey values of a picture or an NPY file, for a floor.

    Raises:
        MapError: it is missing, too large, or not grey.
    """
    is_array = path.suffix.lower() == ".npy"
    values = _npy(path) if is_array else _grey_of(path, read_picture(path, MAX_FLOOR_PIXELS))
    if values.size > MAX_FLOOR_PIXELS:
        raise MapError(f"{path}: expected at most {MAX_FLOOR_PIXELS} pixels, got {values.size}")
    if min(values.shape) < 2:
        raise MapError(f"{path}: expected at least 2 x 2 pixels, got {values.shape}")
    kind = values.dtype.name
    packed = zlib.compress(values.astype(KINDS[kind]).tobytes(), 9)
    rows, columns = values.shape
    return Samples(rows=rows, columns=columns, kind=kind, packed=packed)  # type: ignore[arg-type]


def _grey_of(path: Path, pixels: NDArray[Any]) -> NDArray[Any]:
    """Return the one channel of a picture without colours: a floor's grey is a measure."""
    if pixels.ndim == 2:
        return pixels
    grey = pixels[:, :, 0]
    has_colours = any((pixels[:, :, i] != grey).any() for i in (1, 2))
    is_clear = pixels.shape[2] == 4 and bool((pixels[:, :, 3] < np.iinfo(pixels.dtype).max).any())
    if has_colours or is_clear:
        got = "colours" if has_colours else "transparent pixels"
        raise MapError(
            f"{path}: expected a grey picture, got {got}: save it as greyscale without alpha"
        )
    return grey


def unpack(samples: Samples) -> Floats:
    """Return the grey values, shape (rows, columns) from the lowest row up.

    Raises:
        MapError: the packed values are not as many as they should be.
    """
    try:
        raw = zlib.decompress(samples.packed)
        values = np.frombuffer(raw, KINDS[samples.kind]).reshape(samples.rows, samples.columns)
    except (zlib.error, ValueError) as error:
        raise MapError(f"a picture of the floor cannot be unpacked: {error}") from error
    return np.ascontiguousarray(values[::-1], dtype=np.float64)


def full_scale(samples: Samples) -> float:
    """Return the value that means white."""
    return {"uint8": 255.0, "uint16": 65535.0, "float32": 1.0}[samples.kind]


def _npy(path: Path) -> NDArray[np.float32]:
    try:
        values = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise MapError(f"{path}: cannot be read: {error}") from error
    if values.ndim != 2 or values.dtype.kind not in "iuf" or not np.isfinite(values).all():
        raise MapError(
            f"{path}: expected finite numbers in rows and columns, got {values.dtype} of shape "
            f"{values.shape}"
        )
    return np.asarray(values, dtype=np.float32)
