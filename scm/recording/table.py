"""Files of rows: CSV, gzipped CSV and NPZ, as named columns of floats.

A column becomes numbers when somebody asks for it: text in one that nobody names does no harm.
"""

import csv
import gzip
import io
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError, nearest

SUFFIXES = (".csv", ".csv.gz", ".npz")
LARGEST_BYTES = 1 << 30
WORDS = {
    **dict.fromkeys(("", "nan", "na", "n/a", "null", "none"), np.nan),
    "true": 1.0,
    "false": 0.0,
}


class Columns(Mapping[str, Floats]):
    """The columns of one file, each of shape `(rows,)`; an empty cell is NaN.

    Asking for a column raises a `RecordingError` when there is none of that name, when its name
    stands twice, or, with the line, when a cell is not a number.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        cells: Sequence[Sequence[str] | Floats],
        lines: Sequence[int] = (),
    ) -> None:
        self._path = path
        self._count = Counter(names)
        self._cells = dict(zip(names, cells, strict=True))
        self._lines = lines
        self._numbers: dict[str, Floats] = {}

    def __getitem__(self, name: str) -> Floats:
        """Return a column as numbers."""
        if name not in self._numbers:
            self._numbers[name] = self._read(name)
        return self._numbers[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, of text columns too."""
        return iter(self._cells)

    def __len__(self) -> int:
        """Return how many names there are."""
        return len(self._cells)

    def words(self, name: str) -> np.ndarray[tuple[int], np.dtype[np.str_]]:
        """Return a column as text, shape (rows,).

        Raises:
            RecordingError: when there is none of that name, or it holds numbers.
        """
        cells = self._cells.get(name)
        if cells is None:
            msg = f"{self._path}: no column {name!r}{nearest(name, list(self._cells))}"
            raise RecordingError(msg)
        if isinstance(cells, np.ndarray):
            msg = f"{self._path}: column {name!r} holds numbers, not words"
            raise RecordingError(msg)
        return np.array([cell.strip() for cell in cells], dtype=np.str_)

    @property
    def rows(self) -> int:
        """How many rows each column has."""
        return len(next(iter(self._cells.values()), ()))

    def _read(self, name: str) -> Floats:
        if name not in self._cells:
            hint = nearest(name, list(self._cells)) or f"; it has {', '.join(self._cells)}"
            msg = f"{self._path}: no column {name!r}{hint}"
            raise RecordingError(msg)
        if self._count[name] > 1:
            msg = f"{self._path}: {self._count[name]} columns are named {name!r}"
            raise RecordingError(msg)
        cells = self._cells[name]
        if isinstance(cells, np.ndarray):
            return cells
        numbers = (
            _number(cell, f"{self._path}: line {line}, column {name!r}")
            for line, cell in zip(self._lines, cells, strict=True)
        )
        return np.fromiter(numbers, np.float64, len(cells))


def read_table(path: Path) -> Columns:
    """Return the columns of a file.

    Raises:
        RecordingError: naming the file, and for CSV the line that cannot be read.
    """
    if not path.is_file():
        msg = f"{path}: {'a folder, expected a file' if path.is_dir() else 'no such file'}"
        raise RecordingError(msg)
    try:
        if path.name.endswith(".npz"):
            return _read_npz(path)
        if path.name.endswith((".csv", ".csv.gz")):
            return _read_csv(_text(path), path)
    except (OSError, EOFError, ValueError, zipfile.BadZipFile, csv.Error) as cause:
        if isinstance(cause, RecordingError):
            raise
        msg = f"{path}: cannot be read: {cause}"
        raise RecordingError(msg) from cause
    msg = f"{path}: got a {path.suffix or 'nameless'} file, expected one of {', '.join(SUFFIXES)}"
    raise RecordingError(msg)


def _read_npz(path: Path) -> Columns:
    """Return the one-dimensional numeric arrays of an NPZ file; others are for other readers."""
    with zipfile.ZipFile(path) as members:
        _refuse_large(sum(member.file_size for member in members.infolist()), path)
    columns: dict[str, Floats] = {}
    with np.load(path, allow_pickle=False) as arrays:
        for name in arrays.files:
            array = arrays[name] if _is_plain(path, name) else np.empty((0, 0))
            if array.ndim == 1 and array.dtype.kind in "biuf":
                columns[name] = np.asarray(array, np.float64)
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        msg = f"{path}: columns of different lengths: {lengths}"
        raise RecordingError(msg)
    return Columns(path, list(columns), list(columns.values()))


def _is_plain(path: Path, name: str) -> bool:
    """Say whether an array holds plain values: one of Python objects would have to be unpickled."""
    with zipfile.ZipFile(path) as members, members.open(f"{name}.npy") as stream:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0
        header = (read if version == (1, 0) else np.lib.format.read_array_header_2_0)(stream)
    return not header[2].hasobject


def _text(path: Path) -> str:
    """Return the text of a plain or gzipped file, without a byte order mark."""
    with gzip.open(path) if path.name.endswith(".gz") else path.open("rb") as stream:
        data: bytes = stream.read(LARGEST_BYTES + 1)
    _refuse_large(len(data), path)
    return data.decode("utf-8-sig")


def _refuse_large(size: int, path: Path) -> None:
    if size > LARGEST_BYTES:
        msg = f"{path}: holds more than {LARGEST_BYTES >> 20} MiB: split it"
        raise RecordingError(msg)


def _read_csv(text: str, path: Path) -> Columns:
    """Return the columns of a CSV file; lines that are empty or start with # are comments."""
    csv.field_size_limit(LARGEST_BYTES)
    header, skip = _header(text, path)
    delimiter = _delimiter(header)
    names = [name.strip() for name in next(csv.reader([header], delimiter=delimiter))]
    body = io.StringIO(text, newline=None)
    for _ in range(skip):
        body.readline()
    start = body.tell()
    if not body.read().strip():
        msg = f"{path}: no rows below the header"
        raise RecordingError(msg)
    body.seek(start)
    try:
        cells = np.loadtxt(body, delimiter=delimiter, ndmin=2)
    except ValueError:
        cells = np.empty((0, 0))
    if cells.shape[1] == len(names):
        return Columns(path, names, list(np.ascontiguousarray(cells.T)))
    body.seek(start)
    return _read_cells(csv.reader(body, delimiter=delimiter), skip, names, path)


def _header(text: str, path: Path) -> tuple[str, int]:
    """Return the line that names the columns, and how many lines end with it.

    It is the first that is no comment; but where that one holds numbers, the comment above it.
    """
    comment = None
    for number, line in enumerate(io.StringIO(text, newline=None), start=1):
        stripped = line.strip()
        if stripped.startswith("#"):
            comment = stripped.lstrip("# "), number
        elif stripped:
            if not _is_numbers(stripped):
                return stripped, number
            if comment is not None:
                return comment
            msg = f"{path}: line {number}: got numbers, expected the names of the columns"
            raise RecordingError(msg)
    msg = f"{path}: no rows below the header"
    raise RecordingError(msg)


def _is_numbers(line: str) -> bool:
    try:
        [float(cell) for cell in line.split(_delimiter(line))]
    except ValueError:
        return False
    return True


def _delimiter(line: str) -> str:
    """Return what stands between a line's cells: a comma, or where it has none ; or a tab."""
    return next((mark for mark in (",", ";", "\t") if mark in line), ",")


def _read_cells(reader: Iterator[list[str]], skip: int, names: list[str], path: Path) -> Columns:
    """Read cell by cell: slow, tolerates empty cells and text, and knows where a bad one is."""
    rows, lines = [], []
    for row in reader:
        line = skip + reader.line_num  # type: ignore[attr-defined]
        if not any(row) or row[0].lstrip().startswith("#"):
            continue
        if len(row) == len(names) + 1 and not row[-1].strip():
            row.pop()
        if len(row) != len(names):
            msg = f"{path}: line {line}: {len(row)} values, expected {len(names)} as in the header"
            raise RecordingError(msg)
        rows.append(row)
        lines.append(line)
    return Columns(path, names, list(zip(*rows, strict=True)) or [()] * len(names), lines)


def _number(cell: str, where: str) -> float:
    """Return a cell as a number; an empty one, or a word for it, is NaN."""
    text = cell.strip()
    try:
        value = WORDS.get(text.lower())
        return float(text.replace("_", "?")) if value is None else value
    except ValueError as cause:
        msg = f"{where}: got {text[:40]!r}, expected a number"
        raise RecordingError(msg) from cause
