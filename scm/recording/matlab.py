"""MATLAB's .mat files up to version 7.2 as columns.

A vector is a column; of a struct `log` the field `log.x`, of a matrix `m` its first column `m[0]`.
"""

import re
import warnings
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
import scipy.io

from scm.arrays import Floats, Ints
from scm.errors import RecordingError
from scm.recording.columns import Columns, refuse_large, refuse_unequal

HEADER_BYTES = 128
COMPRESSED = 15
PIECE_BYTES = 1 << 20
NUMBERS = "biuf"


def read(path: Path, topic: str | None, wanted: Collection[str] | None) -> Columns:
    """Return the wanted columns of a .mat file.

    Raises:
        RecordingError: when it is of version 7.3, too large, or the columns differ in length.
    """
    del topic
    refuse_large(_unpacked_bytes(path), path)
    tops = None if wanted is None else sorted({re.split(r"[.\[]", name)[0] for name in wanted})
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            variables = [name for name, _, _ in scipy.io.whosmat(path)]
            content = scipy.io.loadmat(path, variable_names=tops, squeeze_me=True)
    except NotImplementedError as cause:
        msg = f"{path}: a .mat file of version 7.3 (HDF5): save it with -v7"
        raise RecordingError(msg) from cause
    found: dict[str, np.ndarray[Any, Any]] = {}
    for name in variables:
        if name in content:
            found.update(_columns(name, content[name]))
    arrays = {name: array for name, array in found.items() if wanted is None or name in wanted}
    refuse_unequal(arrays, path)
    cells: list[Floats] = [np.asarray(array, np.float64) for array in arrays.values()]
    ticks: dict[str, tuple[Ints, int]] = {
        name: (array.astype(np.int64), 1)
        for name, array in arrays.items()
        if array.dtype.kind in "iu" and array.max(initial=0) <= np.iinfo(np.int64).max
    }
    known = list(found) + [name for name in variables if name not in content]
    return Columns(path, list(arrays), cells, known=known, ticks=ticks)


def _columns(name: str, value: Any) -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    """Yield the columns of a variable, by name; a number is a column of one row."""
    array = np.asarray(value)
    if array.dtype.names is not None:
        for field in array.dtype.names:
            held = array[field]
            yield from _columns(f"{name}.{field}", held.item() if held.ndim == 0 else _plain(held))
    elif array.dtype.kind in NUMBERS and array.ndim < 2:
        yield name, array.reshape(-1)
    elif array.dtype.kind in NUMBERS and array.ndim == 2:
        for k, column in enumerate(array.T):
            yield f"{name}[{k}]", column


def _plain(held: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return one field of an array of structs as numbers, where each holds one."""
    numbers = all(np.ndim(one) == 0 and np.asarray(one).dtype.kind in NUMBERS for one in held.flat)
    return np.array(held.tolist()) if numbers and held.ndim == 1 else held


def _unpacked_bytes(path: Path) -> int:
    """Return how large the file is when its compressed variables are unpacked; stops early."""
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
