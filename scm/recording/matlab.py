"""MATLAB's .mat files up to version 7.2 as columns; see `arrays.py` for their names.

Of an array of structs `log` the field of the first is `log[0].x`, and `log.x` where each holds one
number.
"""

import re
import warnings
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
import scipy.io

from scm.errors import RecordingError
from scm.recording.arrays import NUMBERS, Array, as_columns, columns_of
from scm.recording.columns import Columns, Selection, refuse_large

HEADER_BYTES = 128
COMPRESSED = 15
PIECE_BYTES = 1 << 20
MAX_STRUCTS = 100  # of one array that get names of their own
MAX_DEPTH = 20  # of structs within structs
HDF5 = b"\x89HDF\r\n\x1a\n"
OCTAVE = b"# Created by Octave"
OBJECTS = ("opaque", "object", "function")


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted columns of a .mat file.

    Raises:
        RecordingError: when it is of version 7.3, too large, or the columns differ in length.
    """
    _refuse_other_versions(path)
    refuse_large(_unpacked_bytes(path), path)
    wanted = selection.wanted
    tops = None if wanted is None else sorted({re.split(r"[.\[]", name)[0] for name in wanted})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        variables = {name: kind for name, _, kind in scipy.io.whosmat(path)}
        content = scipy.io.loadmat(path, variable_names=tops, squeeze_me=True)
    objects = [name for name, kind in variables.items() if kind in OBJECTS]
    if objects and not set(tops or ()) <= set(variables) - set(objects):
        msg = (
            f"{path}: holds MATLAB objects (a timeseries, a table): save their numbers: "
            "`t = x.Time; v = x.Data; save('drive.mat', 't', 'v', '-v7')`"
        )
        raise RecordingError(msg)
    found: dict[str, Array] = {}
    for name in variables:
        if name in content:
            found.update(_columns(name, content[name]))
    return as_columns(path, found, wanted, [name for name in variables if name not in content])


def _refuse_other_versions(path: Path) -> None:
    with path.open("rb") as stream:
        begin = stream.read(HEADER_BYTES)
        stream.seek(512)  # where the text before it ends
        is_hdf5 = begin.startswith(HDF5) or stream.read(len(HDF5)) == HDF5
    if is_hdf5:
        msg = f"{path}: a .mat file of version 7.3 (HDF5): save it with -v7"
        raise RecordingError(msg)
    if begin.startswith(OCTAVE):
        msg = f"{path}: a text file of Octave: save it with `save -v7`"
        raise RecordingError(msg)


def _columns(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Array]]:
    """Yield the columns of a variable, by name."""
    array = np.asarray(value)
    if array.dtype.names is None:
        yield from columns_of(name, array)
    elif depth < MAX_DEPTH:
        for field in array.dtype.names:
            held = array[field]
            if held.ndim == 0:
                yield from _columns(f"{name}.{field}", held.item(), depth + 1)
                continue
            yield from columns_of(f"{name}.{field}", _plain(held))
            for k, one in enumerate(held.flat[:MAX_STRUCTS]):
                yield from _columns(f"{name}[{k}].{field}", one, depth + 1)


def _plain(held: Array) -> Array:
    """Return one field of an array of structs as numbers, where each holds one."""
    numbers = all(np.ndim(one) == 0 and np.asarray(one).dtype.kind in NUMBERS for one in held.flat)
    return np.array(held.tolist()) if numbers and held.ndim == 1 else held


def _unpacked_bytes(path: Path) -> int:
    """Return how large the file is when its compressed variables are unpacked."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        order = {b"IM": "little", b"MI": "big"}.get(stream.read(HEADER_BYTES)[126:])
        while order is not None and len(tag := stream.read(8)) == 8:
            kind, length = (int.from_bytes(part, order) for part in (tag[:4], tag[4:]))  # type: ignore[arg-type]
            if kind != COMPRESSED:
                stream.seek(length, 1)
                continue
            size += _inflated(stream, length)
    return size


def _inflated(stream: IO[bytes], length: int) -> int:
    """Return how long the next bytes of a stream are when they are unpacked."""
    inflate, size = zlib.decompressobj(), 0
    while length > 0 and (packed := stream.read(min(length, PIECE_BYTES))):
        length -= len(packed)
        while packed:
            size += len(inflate.decompress(packed, PIECE_BYTES))
            packed = inflate.unconsumed_tail
    return size
