"""MATLAB's .mat files up to version 7.2 as columns; see `arrays.py` for their names.

In an array of structs `log` the field of the first is `log[0].x`, and `log.x` is a column if each
holds one number. The format is read here because scipy's reader crashes on damaged files.
"""

import math
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.arrays import Array, as_columns, columns_of
from scm.recording.columns import Columns, Selection, refuse_large

HEADER_BYTES, NAME_BYTES = 128, 4096
MATRIX, COMPRESSED = 14, 15
TYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip  # how the values of an element are stored
CLASSES = {
    6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8",
}  # fmt: skip  # what the values of a matrix are
CELL, STRUCT, OBJECT, FUNCTION, OPAQUE = 1, 2, 3, 16, 17
COMPLEX = 0x08
MAX_STRUCTS = 100  # of one array that get names of their own
MAX_DEPTH = 20  # of structs within structs
MAX_DIMENSIONS = 32
OLD_TYPES = ("f8", "f4", "i4", "i2", "u2", "u1")  # of version 4
HDF5, OCTAVE = b"\x89HDF\r\n\x1a\n", b"# Created by Octave"


class Head(NamedTuple):
    """What a matrix is."""

    kind: int
    is_complex: bool
    dimensions: tuple[int, ...]
    name: str


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted columns of a .mat file.

    Raises:
        RecordingError: when it is of version 7.3, too large, or the columns differ in length.
    """
    wanted = selection.wanted
    tops = None if wanted is None else {re.split(r"[.\[]", name)[0] for name in wanted}
    found: dict[str, Array] = {}
    known: list[str] = []
    with path.open("rb") as stream:
        begin = stream.read(HEADER_BYTES)
        _refuse_other_versions(path, stream, begin)
        order = {b"IM": "<", b"MI": ">"}.get(begin[126:])
        variables = _Variables(path, stream, tops)
        for name, value in variables.old() if order is None else variables.all(order):
            columns = dict(_columns(name, value))
            if value is None or (tops is not None and name not in tops):
                known.append(name)
            found.update(columns)
    if variables.objects and not (tops or set()) <= {*found, *_tops(found)}:
        names = ", ".join(variables.objects)
        msg = (
            f"{path}: {names}: MATLAB objects (as a timeseries or a table is): save their numbers: "
            "`t = x.Time; v = x.Data; save('drive.mat', 't', 'v', '-v7')`"
        )
        raise RecordingError(msg)
    return as_columns(path, found, wanted, known)


def _tops(names: dict[str, Array]) -> set[str]:
    return {re.split(r"[.\[]", name)[0] for name in names}


def _refuse_other_versions(path: Path, stream: IO[bytes], begin: bytes) -> None:
    stream.seek(512)  # where the text before HDF5 ends
    if begin.startswith(HDF5) or stream.read(len(HDF5)) == HDF5:
        msg = f"{path}: a .mat file of version 7.3 (HDF5): save it with -v7"
        raise RecordingError(msg)
    if begin.startswith(OCTAVE):
        msg = f"{path}: a text file of Octave: save it with `save -v7`"
        raise RecordingError(msg)


def _columns(name: str, value: Any) -> Iterator[tuple[str, Array]]:
    """Yield the columns of a variable, by name."""
    if isinstance(value, dict):
        for field, held in value.items():
            yield from _columns(f"{name}.{field}", held)
    elif isinstance(value, list):
        for field in dict.fromkeys(f for one in value if isinstance(one, dict) for f in one):
            held = [one.get(field) if isinstance(one, dict) else None for one in value]
            if all(isinstance(one, np.ndarray) and one.ndim == 0 for one in held):
                yield f"{name}.{field}", np.array(held)
        for k, one in enumerate(value[:MAX_STRUCTS]):
            yield from _columns(f"{name}[{k}]", one)
    elif value is not None:
        yield from columns_of(name, value)


class _Variables:
    """The variables of a file: numbers as arrays, structs as dicts, several as lists, or None."""

    def __init__(self, path: Path, stream: IO[bytes], tops: set[str] | None) -> None:
        self._path, self._stream, self._tops = path, stream, tops
        self._size = 0
        self.objects: list[str] = []

    def all(self, order: str) -> Iterator[tuple[str, Any]]:
        """Yield the variables of version 5 to 7.2; those that nobody wants as None."""
        self._stream.seek(HEADER_BYTES)
        while tag := self._stream.read(8):
            kind, length = (int(one) for one in np.frombuffer(tag, f"{order}u4"))
            if kind not in (MATRIX, COMPRESSED):
                msg = f"an element of type {kind}, expected a matrix"
                raise ValueError(msg)
            begin = self._stream.tell()
            head = self._stream.read(min(length, NAME_BYTES))
            if kind == COMPRESSED:  # unpacked as far as the name needs
                head = zlib.decompressobj().decompress(head, NAME_BYTES)[8:]
            about = _Elements(head, order).head()
            if about.kind in (OBJECT, FUNCTION, OPAQUE):
                self.objects.append(about.name)
            if not about.name:  # the workspace of a function
                pass
            elif self._tops is None or about.name in self._tops:
                self._stream.seek(begin)
                yield about.name, self._value(kind, length, order)
            else:
                yield about.name, None
            self._stream.seek(begin + length)

    def _value(self, kind: int, length: int, order: str) -> Any:
        left = limits.MAX_BYTES - self._size
        self._grow(length)
        data = self._stream.read(length)
        if kind == COMPRESSED:
            data = zlib.decompressobj().decompress(data, max(1, left) + 1)
            self._grow(len(data))
            data = data[8:]
        return _Elements(data, order).matrix()

    def _grow(self, size: int) -> None:
        self._size += size
        refuse_large(self._size, self._path)

    def old(self) -> Iterator[tuple[str, Any]]:
        """Yield the variables of version 4, which has matrices of numbers only."""
        self._stream.seek(0)
        while len(head := self._stream.read(20)) == 20:
            order = "<" if int.from_bytes(head[:4], "little") < 5000 else ">"
            kind, high, wide, is_complex, length = (
                int(one) for one in np.frombuffer(head, f"{order}i4")
            )
            if not (0 <= kind % 1000 < 10 * len(OLD_TYPES) and 0 < length < NAME_BYTES):
                msg = "it begins as no version does"
                raise ValueError(msg)
            name = self._stream.read(length).rstrip(b"\0").decode("latin-1")
            stored = np.dtype(order + OLD_TYPES[kind % 100 // 10])
            if high < 0 or wide < 0:
                msg = f"a matrix of {high} x {wide}"
                raise ValueError(msg)
            size = high * wide * stored.itemsize
            self._grow(size * (1 + bool(is_complex)))
            data = self._stream.read(size)
            if is_complex:
                self._stream.seek(size, 1)
            values = np.frombuffer(data, stored).reshape((high, wide), order="F")
            yield name, None if is_complex or kind % 10 else _native(values.squeeze())


class _Elements:
    """Reads elements of the format one after the other."""

    def __init__(self, data: bytes, order: str, depth: int = 0) -> None:
        if depth > MAX_DEPTH:
            msg = f"structs within structs, more than {MAX_DEPTH} deep"
            raise ValueError(msg)
        self._data, self._order, self._depth, self._at = memoryview(data), order, depth, 0

    def _element(self) -> tuple[int, memoryview]:
        """Return the type of the next element and its bytes."""
        kind, length = (
            int(one)
            for one in np.frombuffer(self._data[self._at : self._at + 8], self._order + "u4")
        )
        begin = self._at + 8
        if kind >> 16:  # a small one: its length stands beside its type, its bytes in the tag
            kind, length, begin = kind & 0xFFFF, kind >> 16, self._at + 4
            self._at += 8
        else:
            self._at = begin + (length + 7) // 8 * 8
        data = self._data[begin : begin + length]
        if len(data) != length:
            msg = f"an element of {length} bytes ends after {len(data)}"
            raise ValueError(msg)
        return kind, data

    def _values(self) -> Array:
        """Return the next element as numbers."""
        kind, data = self._element()
        if kind not in TYPES:
            msg = f"an element of type {kind}, expected numbers"
            raise ValueError(msg)
        return np.frombuffer(data, self._order + TYPES[kind])

    def _text(self) -> bytes:
        return bytes(self._element()[1])

    def head(self) -> Head:
        """Read what a matrix is."""
        flags = int(self._values()[0])
        kind = flags & 0xFF
        dimensions: tuple[int, ...] = ()
        if kind != OPAQUE:
            dimensions = tuple(int(one) for one in self._values())
        name = self._text().decode("latin-1")
        if len(dimensions) > MAX_DIMENSIONS or any(one < 0 for one in dimensions):
            msg = f"a matrix of {dimensions[:MAX_DIMENSIONS]}"
            raise ValueError(msg)
        return Head(kind, bool(flags >> 8 & COMPLEX), dimensions, name)

    def matrix(self) -> Any:
        """Read the content of a matrix: an array, a dict, a list of what it holds, or None."""
        if not self._data:
            return None
        kind, is_complex, dimensions, _ = self.head()
        if kind in CLASSES and not is_complex:
            values = self._values().astype(CLASSES[kind])
            return values.reshape(dimensions, order="F").squeeze()
        count = math.prod(dimensions)
        if kind not in (CELL, STRUCT):
            return None
        if count > len(self._data):
            msg = f"an array of {dimensions} in {len(self._data)} bytes"
            raise ValueError(msg)
        if kind == CELL:
            return [self._part() for _ in range(count)]
        longest, names = int(self._values()[0]), self._text()
        fields = [
            names[at : at + longest].split(b"\0")[0].decode("latin-1")
            for at in range(0, len(names), max(1, longest))
        ]
        structs = [{field: self._part() for field in fields} for _ in range(count)]
        return structs[0] if count == 1 else structs

    def _part(self) -> Any:
        kind, data = self._element()
        if kind != MATRIX:
            msg = f"an element of type {kind}, expected a matrix"
            raise ValueError(msg)
        return _Elements(bytes(data), self._order, self._depth + 1).matrix()


def _native(values: Array) -> Array:
    return values.astype(values.dtype.newbyteorder("="))
