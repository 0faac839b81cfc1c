"""Reads a table in any supported format: chooses the reader and reports unreadable files.

Every error of a library on a damaged file becomes one line that names the file.
"""

import importlib
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import NamedTuple

from scm.errors import RecordingError, reading
from scm.recording.columns import Columns, Selection

ROS2_BAGS = (".db3", ".mcap")
BAGS = (".bag", *ROS2_BAGS)
MORE_BAGS = (".db3.zstd", ".mcap.zstd", ".bag.active")  # packed, or as ROS 1 writes it
TEXTS = (".csv", ".txt", ".tsv", ".dat", ".tum", ".log")
Reader = Callable[[Path, Selection], Columns]


class Kind(NamedTuple):
    """A kind of file: what it is called, the module with its `read`, and what that needs."""

    what: str
    module: str
    library: str = ""


_TEXT = Kind("a text table", "scm.recording.text")
_BAG = Kind("a ROS bag", "scm.recording.bag", "rosbags")
_ARROW = Kind("a Feather file", "scm.recording.parquet", "pyarrow")
_NUMPY = Kind("a NumPy file", "scm.recording.arrays")
KINDS = {  # how a file's name ends
    **dict.fromkeys(TEXTS, _TEXT),
    **{f"{suffix}.gz": _TEXT for suffix in TEXTS},
    ".npz": _NUMPY,
    ".npy": _NUMPY,
    ".parquet": Kind("a Parquet file", "scm.recording.parquet", "pyarrow"),
    ".feather": _ARROW,
    ".arrow": _ARROW,
    ".mat": Kind("a .mat file", "scm.recording.matlab"),
    **dict.fromkeys((*BAGS, *MORE_BAGS), _BAG),
}
_PANDAS = "with pandas: `pd.read_{}('{}').to_parquet('drive.parquet')` or `.to_csv('drive.csv')`"
_PICKLE = "a pickle can run any program, so it is never opened: write it as a table, " + _PANDAS
_PACKED = "a packed file: unpack it"
REFUSED = {  # how other files' names end -> what to do with them
    **dict.fromkeys((".pkl", ".pickle", ".p"), _PICKLE.format("pickle", "drive.pkl")),
    ".joblib": "a pickle can run any program, so it is never opened: write it as a table, "
    "in Python: `pd.DataFrame(joblib.load('drive.joblib')).to_parquet('drive.parquet')`",
    **dict.fromkeys((".xlsx", ".xls", ".ods"), "a spreadsheet: save the sheet as CSV"),
    **dict.fromkeys(
        (".h5", ".hdf5", ".hdf"), "HDF5: write it as a table, " + _PANDAS.format("hdf", "drive.h5")
    ),
    ".json": "JSON: write it as a table, " + _PANDAS.format("json", "drive.json"),
    **dict.fromkeys(
        (".jsonl", ".ndjson"),
        "JSON: write it as a table, with pandas: "
        "`pd.read_json('drive.jsonl', lines=True).to_csv('drive.csv')`",
    ),
    **dict.fromkeys((".zip", ".tar", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst", ".gz"), _PACKED),
}
CONTENTS = {  # how other kinds of files begin, and how their names should end
    b"PK\x03\x04": ("a zip archive or an Excel file", (".npz",)),
    b"PAR1": ("a Parquet file", (".parquet",)),
    b"ARROW1": ("a Feather file", (".feather", ".arrow")),
    b"\x89HDF\r\n\x1a\n": ("an HDF5 file", (".mat",)),
    b"SQLite format 3\0": ("a ROS 2 bag (.db3)", (".db3",)),
    b"\x89MCAP0\r\n": ("an MCAP file", (".mcap",)),
    b"#ROSBAG V": ("a ROS 1 bag", (".bag", ".bag.active")),
    b"\x93NUMPY": ("a NumPy array (.npy)", (".npy",)),
    b"MATLAB 5.0 MAT-file": ("a .mat file", (".mat",)),
    **{bytes([0x80, v]): ("a Python pickle", ()) for v in range(2, 6)},
}
BAG_FOLDER = "metadata.yaml"


def read_table(
    path: Path,
    topic: str | None = None,
    wanted: Collection[str] | None = None,
    *,
    columns: Sequence[str | None] | None = None,
    definitions: Path | None = None,
) -> Columns:
    """Return the columns of a file.

    Args:
        path: The file, or the folder of a ROS 2 bag.
        topic: As in `Selection`, as are the others.
        wanted: Names of the columns that are needed; None: all.
        columns: Names of the columns by position.
        definitions: Folder of `.msg` files.

    Raises:
        RecordingError: naming the file, and for text the line that cannot be read.
    """
    with reading(path, "a file"):
        kind = _kind(path)
        if topic is not None and kind is not _BAG:
            msg = f"{path}: no ROS bag: it has no topic {topic!r}"
            raise RecordingError(msg)
        if columns is not None and kind is not _TEXT and not path.name.lower().endswith(".npy"):
            msg = f"{path}: {kind.what} names its columns itself: take `columns:` out of the table"
            raise RecordingError(msg)
        _refuse_content(path, kind)
        read = _reader(path, kind)
    with reading(path, kind.what):
        return read(path, Selection(topic, wanted, columns, definitions))


def refuse_data(path: Path) -> None:
    """Refuse a file of data, or of another program's, where a description is expected.

    Raises:
        RecordingError: when the name ends as such files do, with what to give instead.
    """
    name = path.name.lower()
    if name.endswith(tuple(KINDS)):
        msg = f"{path}: a file of data: give the recording.yaml that says what stands where in it"
        raise RecordingError(msg)
    _refuse_name(path)


def _refuse_name(path: Path) -> None:
    for suffix, way_out in REFUSED.items():
        if path.name.lower().endswith(suffix):
            msg = f"{path}: {way_out}"
            raise RecordingError(msg)


def _kind(path: Path) -> Kind:
    """Return which kind of file it is, by its name.

    Raises:
        RecordingError: when it is not there, or of no kind that can be read.
    """
    if path.is_dir():
        if _is_bag(path):
            return _BAG
        msg = f"{path}: a folder, expected a file or the folder of a ROS 2 bag"
        raise RecordingError(msg)
    if not path.is_file():
        msg = f"{path}: {'not a regular file' if path.exists() else 'no such file'}"
        raise RecordingError(msg)
    name = path.name.lower()
    for suffix, kind in KINDS.items():
        if name.endswith(suffix):
            return kind
    _refuse_name(path)
    got = path.suffix or "nameless"
    names = [suffix for suffix in KINDS if suffix.count(".") == 1]
    msg = f"{path}: got a {got} file, expected one of {', '.join(names)}; text may be gzipped (.gz)"
    raise RecordingError(msg)


def _is_bag(folder: Path) -> bool:
    """Say whether a folder is that of a ROS 2 bag; its metadata may be missing."""
    return (folder / BAG_FOLDER).is_file() or any(
        path.name.removesuffix(".zstd").endswith(ROS2_BAGS) for path in folder.iterdir()
    )


def _refuse_content(path: Path, kind: Kind) -> None:
    """Refuse a file that is empty, or whose content is of another kind than its name says."""
    if path.is_dir():
        return
    with path.open("rb") as stream:
        begin = stream.read(32)
    if not begin:
        msg = f"{path}: empty, expected {kind.what}"
        raise RecordingError(msg)
    for mark, (what, suffixes) in CONTENTS.items():
        if begin.startswith(mark) and not path.name.lower().endswith(suffixes):
            do = f": rename it to {suffixes[0]}" if suffixes else f": {REFUSED['.pkl']}"
            msg = f"{path}: got {what}, expected {kind.what}{do}"
            raise RecordingError(msg)


def _reader(path: Path, kind: Kind) -> Reader:
    """Return what reads a kind of file.

    Raises:
        RecordingError: when a library for it is not installed.
    """
    try:
        reader: Reader = importlib.import_module(kind.module).read
    except ModuleNotFoundError as cause:
        if (cause.name or "").split(".")[0] != kind.library:
            raise
        msg = (
            f"{path}: reading it needs {kind.library}, which is not installed: "
            "pip install -e '.[formats]'"
        )
        raise RecordingError(msg) from cause
    return reader
