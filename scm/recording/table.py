"""Files of rows as named columns of floats: CSV, gzipped CSV and NPZ, and whose reader is asked.

A column becomes numbers when somebody asks for it: text in one that nobody names does no harm.
"""

import csv
import gzip
import importlib
import io
import zipfile
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.columns import Columns, refuse_large, refuse_unequal

BAGS = (".bag", ".db3", ".mcap")
READERS = {  # how a file's name ends -> the module with `read`, and what it needs installed
    ".parquet": ("scm.recording.parquet", "pyarrow"),
    ".mat": ("scm.recording.matlab", "scipy"),
    **dict.fromkeys(BAGS, ("scm.recording.bag", "rosbags")),
}
SUFFIXES = (".csv", ".csv.gz", ".npz", *READERS)
BAG_FOLDER = "metadata.yaml"
Reader = Callable[[Path, str | None, Collection[str] | None], Columns]


def read_table(
    path: Path, topic: str | None = None, wanted: Collection[str] | None = None
) -> Columns:
    """Return the columns of a file.

    Args:
        path: The file, or the folder of a ROS 2 bag.
        topic: Whose messages are the rows, where the file is a ROS bag.
        wanted: Names of the columns that will be asked for; None: all. Others may be left out.

    Raises:
        RecordingError: naming the file, and for CSV the line that cannot be read.
    """
    is_bag = path.suffix in BAGS or (path / BAG_FOLDER).is_file()
    if not path.is_file() and not (is_bag and path.is_dir()):
        msg = f"{path}: {'a folder, expected a file' if path.is_dir() else 'no such file'}"
        raise RecordingError(msg)
    if topic is not None and not is_bag:
        msg = f"{path}: no ROS bag: it has no topic {topic!r}"
        raise RecordingError(msg)
    read = _reader(path, is_bag)
    try:
        return read(path, topic, wanted)
    except RecordingError:
        raise
    except Exception as cause:  # whatever a library makes of a damaged file
        kind = "" if isinstance(cause, OSError | ValueError) else f"{type(cause).__name__}: "
        msg = f"{path}: cannot be read: {kind}{cause}"
        raise RecordingError(msg) from cause


def _reader(path: Path, is_bag: bool) -> Reader:
    """Return what reads a file of that name.

    Raises:
        RecordingError: when nothing does, or a library for it is not installed.
    """
    if path.name.endswith(".npz"):
        return _read_npz
    if path.name.endswith((".csv", ".csv.gz")):
        return _read_csv
    suffix = BAGS[0] if is_bag else path.suffix
    if suffix not in READERS:
        got = path.suffix or "nameless"
        msg = f"{path}: got a {got} file, expected one of {', '.join(SUFFIXES)}"
        raise RecordingError(msg)
    module, library = READERS[suffix]
    try:
        reader: Reader = importlib.import_module(module).read
    except ModuleNotFoundError as cause:
        if (cause.name or "").split(".")[0] != library:
            raise
        msg = (
            f"{path}: reading it needs {library}, which is not installed: "
            "pip install -e '.[formats]'"
        )
        raise RecordingError(msg) from cause
    return reader


def _read_npz(path: Path, topic: str | None, wanted: Collection[str] | None) -> Columns:
    """Return the one-dimensional numeric arrays of an NPZ file; others are for other readers."""
    del topic, wanted
    with zipfile.ZipFile(path) as members:
        refuse_large(sum(member.file_size for member in members.infolist()), path)
    columns: dict[str, Floats] = {}
    with np.load(path, allow_pickle=False) as arrays:
        for name in arrays.files:
            array = arrays[name] if _is_plain(path, name) else np.empty((0, 0))
            if array.ndim == 1 and array.dtype.kind in "biuf":
                columns[name] = np.asarray(array, np.float64)
    refuse_unequal(columns, path)
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
        data: bytes = stream.read(limits.LARGEST_BYTES + 1)
    refuse_large(len(data), path)
    return data.decode("utf-8-sig")


def _read_csv(path: Path, topic: str | None, wanted: Collection[str] | None) -> Columns:
    """Return the columns of a CSV file; lines that are empty or start with # are comments."""
    del topic, wanted
    text = _text(path)
    csv.field_size_limit(limits.LARGEST_BYTES)
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
