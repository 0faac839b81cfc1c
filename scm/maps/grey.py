"""Reads grey pictures for a floor: PNG and PGM of 8 or 16 bit, and NPY arrays of numbers.

PNG is read here because map files are read where no image library is: signals, agents, messages.
"""

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats
from scm.errors import MapError
from scm.maps.grid import read_pgm
from scm.maps.model import Samples

MOST_PIXELS = 4_000_000
KINDS = {"uint8": "<u1", "uint16": "<u2", "float32": "<f4"}
ENDINGS = (".png", ".pgm", ".npy")

_PNG = b"\x89PNG\r\n\x1a\n"
_GREY = 0


def read_grey(path: Path) -> Samples:
    """Return the grey values of a file.

    Raises:
        MapError: it is missing, too large, or no grey picture.
    """
    if path.suffix.lower() not in ENDINGS:
        raise MapError(f"{path}: expected a file that ends in {', '.join(ENDINGS)}")
    if not path.is_file():
        raise MapError(f"{path}: there is no such picture")
    values: NDArray[Any] = {".png": _png, ".pgm": read_pgm, ".npy": _npy}[path.suffix.lower()](path)
    if values.size > MOST_PIXELS:
        raise MapError(f"{path}: expected at most {MOST_PIXELS} pixels, got {values.size}")
    if min(values.shape) < 2:
        raise MapError(f"{path}: expected at least 2 x 2 pixels, got {values.shape}")
    kind = values.dtype.name
    packed = zlib.compress(values.astype(KINDS[kind]).tobytes(), 9)
    rows, columns = values.shape
    return Samples(rows=rows, columns=columns, kind=kind, packed=packed)  # type: ignore[arg-type]


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


def _png(path: Path) -> NDArray[Any]:
    data = path.read_bytes()
    if not data.startswith(_PNG):
        raise MapError(f"{path}: expected a PNG picture, got {data[:8]!r}")
    header, packed = b"", b""
    at = len(_PNG)
    while at + 8 <= len(data):
        (length,), name = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        header = body if name == b"IHDR" else header
        packed += body if name == b"IDAT" else b""
        at += 12 + length
    if len(header) != 13:
        raise MapError(f"{path}: the PNG picture has no header")
    width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if colour != _GREY or bits not in {8, 16} or interlaced:
        raise MapError(
            f"{path}: expected a plain grey PNG of 8 or 16 bit; got colour type {colour}, {bits} "
            f"bit{', interlaced' if interlaced else ''}: save it as greyscale without alpha"
        )
    try:
        raw = zlib.decompress(packed)
        lines = np.frombuffer(raw, np.uint8).reshape(height, 1 + width * bits // 8)
    except (zlib.error, ValueError) as error:
        raise MapError(f"{path}: the PNG picture is damaged: {error}") from error
    pixels = _unfiltered(lines, bits // 8)
    return pixels if bits == 8 else pixels.view(">u2").astype(np.uint16)


def _unfiltered(lines: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """Undo PNG's line filters: each byte was stored as the difference from its neighbours."""
    out = np.zeros((len(lines) + 1, step + lines.shape[1] - 1), np.uint8)  # a rim of zeros
    for row, line in enumerate(lines):
        above, here = out[row], out[row + 1]
        rule, stored = int(line[0]), line[1:]
        if rule == 2:
            here[step:] = stored + above[step:]
        elif rule == 1:
            for i in range(step):
                here[step + i :: step] = np.cumsum(stored[i::step], dtype=np.uint8)
        elif rule == 0:
            here[step:] = stored
        else:
            _predicted(here, above.tolist(), stored.tolist(), step, rule)
    return np.ascontiguousarray(out[1:, step:])


def _predicted(
    here: NDArray[np.uint8], above: list[int], stored: list[int], step: int, rule: int
) -> None:
    """Undo the two filters that look left and up at once (3: their mean, 4: Paeth's choice)."""
    line = [0] * step
    for i, byte in enumerate(stored, start=step):
        left, up, corner = line[i - step], above[i], above[i - step]
        if rule == 3:
            guess = (left + up) // 2
        else:
            to_left, to_up = abs(up - corner), abs(left - corner)
            to_corner = abs(left + up - 2 * corner)
            nearest_up = up if to_up <= to_corner else corner
            guess = left if to_left <= to_up and to_left <= to_corner else nearest_up
        line.append((byte + guess) & 0xFF)
    here[:] = line
