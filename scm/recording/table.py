"""Files of rows: CSV, gzipped CSV and NPZ, as named columns of floats."""

import csv
import gzip
import io
import zipfile
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError

SUFFIXES = (".csv", ".csv.gz", ".npz")


def read_table(path: Path) -> dict[str, Floats]:
    """Return the columns of a file, each of shape `(rows,)`; an empty cell is NaN.

    Raises:
        RecordingError: naming the file, and for CSV the line and column that cannot be read.
    """
    if not path.is_file():
        msg = f"{path}: no such file"
        raise RecordingError(msg)
    try:
        if path.name.endswith(".npz"):
            return _read_npz(path)
        if path.name.endswith(".csv.gz"):
            return _read_csv(gzip.decompress(path.read_bytes()).decode("utf-8"), path)
        if path.name.endswith(".csv"):
            return _read_csv(path.read_text(encoding="utf-8"), path)
    except (OSError, EOFError, UnicodeDecodeError, zipfile.BadZipFile) as cause:
        msg = f"{path}: cannot be read: {cause}"
        raise RecordingError(msg) from cause
    msg = f"{path}: got a {path.suffix or 'nameless'} file, expected one of {', '.join(SUFFIXES)}"
    raise RecordingError(msg)


def _read_npz(path: Path) -> dict[str, Floats]:
    """Return the one-dimensional arrays of an NPZ file; others are for other readers."""
    with np.load(path, allow_pickle=False) as arrays:
        columns = {name: np.asarray(arrays[name], np.float64) for name in arrays.files}
    return {name: values for name, values in columns.items() if values.ndim == 1}


def _read_csv(text: str, path: Path) -> dict[str, Floats]:
    """Return the columns of a CSV file whose first line names them."""
    header = next(csv.reader(io.StringIO(text)), [])
    names = [name.strip() for name in header]
    if len(set(names)) != len(names):
        msg = f"{path}: line 1: a column name stands twice: {names}"
        raise RecordingError(msg)
    if not text.partition("\n")[2].strip():
        msg = f"{path}: no rows below the header"
        raise RecordingError(msg)
    try:
        cells = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)
    except ValueError:
        cells = _read_cells(text, names, path)
    if cells.shape[1] != len(names):
        msg = f"{path}: {cells.shape[1]} values a line, expected {len(names)} as in the header"
        raise RecordingError(msg)
    return {name: np.ascontiguousarray(cells[:, i]) for i, name in enumerate(names)}


def _read_cells(text: str, names: list[str], path: Path) -> Floats:
    """Read cell by cell: slow, tolerates empty cells, and knows where a bad one is."""
    rows = []
    for line, row in enumerate(csv.reader(io.StringIO(text)), start=1):
        if line == 1 or not row:
            continue
        if len(row) != len(names):
            msg = f"{path}: line {line}: {len(row)} values, expected {len(names)} as in the header"
            raise RecordingError(msg)
        rows.append(
            [_number(cell, path, line, name) for cell, name in zip(row, names, strict=True)]
        )
    return np.array(rows, dtype=np.float64).reshape(-1, len(names))


def _number(cell: str, path: Path, line: int, column: str) -> float:
    """Return a cell as a number; an empty one is NaN."""
    if not cell.strip():
        return float("nan")
    try:
        return float(cell)
    except ValueError as cause:
        msg = f"{path}: line {line}, column {column!r}: got {cell!r}, expected a number"
        raise RecordingError(msg) from cause
