"""Arrays as columns: NPZ and NPY files, and the contents of MATLAB files.

A vector is a column. The columns of a matrix `m` are `m[0]`, `m[1]`; if it is wider than high, as
written by Simulink, its rows are. The field `x` of a structured array `log` is `log.x`. The array
of an NPY file has no name: `[0]`, `x`.
"""

import zipfile
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scm.arrays import Floats, Ints
from scm.errors import RecordingError
from scm.recording.columns import NS_PER_S, Columns, Selection, refuse_large, refuse_unequal

NUMBERS, TIMES = "biuf", "mM"
Array = npt.NDArray[Any]


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted columns of an NPZ or NPY file.

    Raises:
        RecordingError: when it holds Python objects, is too large, or the columns differ in length.
    """
    if path.name.lower().endswith(".npy"):
        return _read_npy(path, selection)
    found: dict[str, Array] = {}
    known: list[str] = []
    with zipfile.ZipFile(path) as members:
        for member in members.namelist():
            name = member.removesuffix(".npy")
            with members.open(member) as stream:
                size = _declared_bytes(stream)
            if size is None:
                continue  # of Python objects: nobody who needs numbers asks for it
            if selection.wanted is not None and not is_of(name, selection.wanted):
                known.append(name)
                continue
            refuse_large(size, path, f"array {name!r} ")
            with members.open(member) as stream:
                found.update(columns_of(name, np.lib.format.read_array(stream)))
    return as_columns(path, found, selection.wanted, known)


def _read_npy(path: Path, selection: Selection) -> Columns:
    with path.open("rb") as stream:
        size = _declared_bytes(stream)
    if size is None:
        msg = f"{path}: holds Python objects, a pickle, which is never opened: save its numbers "
        raise RecordingError(msg + "alone, as `np.savez('drive.npz', t=t, x=x)`")
    refuse_large(size, path)
    array = np.load(path, allow_pickle=False)
    if selection.columns is None:
        return as_columns(path, dict(columns_of("", array)), selection.wanted)
    columns = [column for _, column in columns_of("", array)]
    if array.ndim != 2 or len(columns) != len(selection.columns):
        names = len(selection.columns)
        msg = f"{path}: an array of shape {array.shape}, but names for {names} columns"
        raise RecordingError(msg)
    named = {
        name: column
        for name, column in zip(selection.columns, columns, strict=True)
        if name is not None
    }
    return as_columns(path, named, selection.wanted)


def _declared_bytes(stream: IO[bytes]) -> int | None:
    """Return how large an array is by its header; None: it holds Python objects."""
    version = np.lib.format.read_magic(stream)
    header = np.lib.format.read_array_header_1_0
    shape, _, kind = (header if version == (1, 0) else np.lib.format.read_array_header_2_0)(stream)
    size = kind.itemsize
    for length in shape:
        size *= int(length)
    return None if kind.hasobject else size


def is_of(name: str, wanted: Collection[str]) -> bool:
    """Say whether one of the wanted columns is an array, or a part of it."""
    return any(one == name or one.startswith((f"{name}.", f"{name}[")) for one in wanted)


def columns_of(name: str, array: Array) -> Iterator[tuple[str, Array]]:
    """Yield the columns of an array, by name; a number is a column of one row."""
    if array.dtype.names is not None and array.ndim < 2:
        for field in array.dtype.names:
            yield from columns_of(f"{name}.{field}" if name else field, array[field])
    elif array.dtype.kind in NUMBERS + TIMES and array.ndim < 2:
        yield name or "[0]", array.reshape(-1)
    elif array.dtype.kind in NUMBERS and array.ndim == 2:
        high, wide = array.shape
        for k, column in enumerate(array if wide > high else array.T):
            yield f"{name}[{k}]", column


def as_columns(
    path: Path,
    found: Mapping[str, Array],
    wanted: Collection[str] | None,
    known: Collection[str] = (),
) -> Columns:
    """Return arrays as columns, whole numbers and times to the nanosecond.

    Args:
        path: Of the file.
        found: Columns by name; `m[0]` is the vector `m`, too.
        wanted: Names of those that are needed; None: all.
        known: Names of what else the file has.

    Raises:
        RecordingError: when those that are wanted differ in length.
    """
    vectors = {f"{name}[0]": array for name, array in found.items() if f"{name}[0]" not in found}
    chosen = {
        name: array
        for name, array in {**found, **vectors}.items()
        if (name in found if wanted is None else name in wanted)
    }
    refuse_unequal(chosen, path)
    cells: list[Floats] = []
    ticks: dict[str, tuple[Ints, int]] = {}
    for name, array in chosen.items():
        whole, per_value = array, 1
        if array.dtype.kind in TIMES:
            whole, per_value = array.astype(f"{array.dtype.kind}8[ns]").astype(np.int64), NS_PER_S
        if whole.dtype.kind in "iu" and whole.max(initial=0) <= np.iinfo(np.int64).max:
            ticks[name] = whole.astype(np.int64), per_value
        cells.append(np.asarray(whole, np.float64) / per_value)
    return Columns(path, list(chosen), cells, known=[*found, *known], ticks=ticks)
