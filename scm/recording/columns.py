"""The columns of one file as numbers or text, for every file format."""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import RecordingError, nearest
from scm.recording.units import UNITS

MAX_BYTES = 1 << 30  # of a table, which is read as a whole
MAX_NAMED = 40  # columns in an error
MAX_BAD_CELLS = 0.1  # of a column; where more are no numbers it is no column of numbers
NS_PER_S = 1_000_000_000
ROW = "row"
WORDS = {
    **dict.fromkeys(("", "nan", "na", "n/a", "null", "none", "#n/a", "-"), np.nan),
    **dict.fromkeys(("1.#ind", "-1.#ind", "1.#qnan", "nan(ind)", "-nan(ind)"), np.nan),  # Windows
    "true": 1.0,
    "false": 0.0,
}
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")
_DATE = re.compile(r"\s*(\d{4}[-/]\d\d[-/]\d\d[ T])?\d\d:\d\d(:\d\d|\s*$)")
_ZONE = re.compile(r"[+-]\d\d:?\d\d$")


class LeftOut(NamedTuple):
    """What a file holds that is no row of its table: where, why, and the line itself.

    Attributes:
        line: Counted from 1; of a bag or a binary table the number of the message or row; None:
            the rest of a file, as of one that is cut off, or many rows, which `why` counts.
    """

    file: str
    line: int | None
    why: str
    text: str = ""

    def __str__(self) -> str:
        """Return it as a sentence: "pose.csv: line 7: got 3 cells, expected 8"."""
        at = "" if self.line is None else f"line {self.line}: "
        return f"{self.file}: {at}{self.why}"


@dataclass(frozen=True, slots=True)
class Selection:
    """What of a file is its table.

    Attributes:
        topic: Whose messages are the rows, where the file is a ROS bag.
        wanted: Names of the columns that will be asked for; None: all. Others may be left out.
        columns: Names of the columns by position, where the file names none; None: of a column
            that nobody needs.
        definitions: Folder of `.msg` files, for a bag without definitions of its messages.
    """

    topic: str | None = None
    wanted: Collection[str] | None = None
    columns: Sequence[str | None] | None = None
    definitions: Path | None = None


class Columns(Mapping[str, Floats]):
    """The columns of one file, each of shape `(rows,)`; an empty cell is NaN.

    `row` counts the rows from 0, unless the file has a column of that name; a row that is left out
    counts too.

    Asking for a column raises a `RecordingError` when there is none of that name, when its name
    stands twice, or, with the line, when its cells are not numbers. A few that are not are NaN, and
    left out; dates with a time of day are seconds since 1970.

    Args:
        path: What to name in an error: the file.
        names, cells: Of each column that was read.
        lines: Where each row stands in the file, for columns of text.
        known: Names of all columns of the file, where only some were read.
        ticks: Columns of whole numbers as such, shape `(rows,)`, and how many make 1 of the
            column's value: seconds that are counted in nanoseconds have `NS_PER_S`.
        left_out: What the file holds besides that is no row.
    """

    def __init__(
        self,
        path: Path,
        names: Sequence[str],
        cells: Sequence[Sequence[str] | Floats],
        lines: Sequence[int] = (),
        *,
        known: Sequence[str] = (),
        ticks: Mapping[str, tuple[Ints, int]] | None = None,
        left_out: Sequence[LeftOut] = (),
    ) -> None:
        self._left_out = list(left_out)
        self._path = path
        self._known = known or names
        self._ticks = dict(ticks or {})
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
            msg = f"{self._path}: no column {name!r}{self._hint(name)}"
            raise RecordingError(msg)
        if isinstance(cells, np.ndarray):
            msg = f"{self._path}: column {name!r} holds numbers, not words"
            raise RecordingError(msg)
        return np.array([cell.strip() for cell in cells], dtype=np.str_)

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What of the file is in no row, and which cells of the columns read so far are no numbers.

        It grows as columns are read.
        """
        return tuple(self._left_out)

    @property
    def rows(self) -> int:
        """How many rows each column has."""
        return len(next(iter(self._cells.values()), ()))

    def nanoseconds(self, name: str, unit: str) -> Ints | None:
        """Return a column of times to the nanosecond, None where it holds no whole numbers.

        Seconds since 1970 as one float are good to a quarter of a microsecond only.
        """
        if name not in self._ticks:
            self._read_dates(name)
        if name not in self._ticks or unit not in UNITS:
            return None
        ticks, per_value = self._ticks[name]
        per_tick, left = divmod(round(UNITS[unit][1] * NS_PER_S), per_value)
        largest = max(-int(ticks.min(initial=0)), int(ticks.max(initial=0)))
        if left or per_tick == 0 or largest * per_tick > np.iinfo(np.int64).max:
            return None
        return ticks * per_tick

    def _hint(self, name: str) -> str:
        """Return which column may have been meant, or which there are."""
        known = list(dict.fromkeys(self._known))
        more = f" and {len(known) - MAX_NAMED} more" if len(known) > MAX_NAMED else ""
        return nearest(name, known) or f"; it has {', '.join(known[:MAX_NAMED])}{more}"

    def _row_count(self) -> Floats:
        """Count the rows from 0; a line that was left out counts too, or later ones would shift."""
        count = np.arange(self.rows, dtype=np.float64)
        if len(self._lines) != self.rows:
            return count
        lost = sorted({one.line for one in self._left_out if one.line}.difference(self._lines))
        return count + np.searchsorted(lost, np.asarray(self._lines))

    def _read(self, name: str) -> Floats:
        if name == ROW and name not in self._known:
            return self._row_count()
        if name not in self._cells:
            msg = f"{self._path}: no column {name!r}{self._hint(name)}"
            raise RecordingError(msg)
        if self._count[name] > 1:
            msg = f"{self._path}: {self._count[name]} columns are named {name!r}"
            raise RecordingError(msg)
        cells = self._cells[name]
        if isinstance(cells, np.ndarray):
            return cells
        if self._read_dates(name):
            ticks, per_value = self._ticks[name]
            return ticks / per_value
        return self._as_numbers(name, cells)

    def _as_numbers(self, name: str, cells: Sequence[str]) -> Floats:
        """Return cells as numbers; a few that are none are NaN, and left out."""
        with suppress(ValueError):
            if not any("_" in cell for cell in cells):
                return np.fromiter(map(float, cells), np.float64, len(cells))
        numbers, bad = np.full(len(cells), np.nan), []
        for k, cell in enumerate(cells):
            try:
                numbers[k] = number(cell, f"column {name!r}")
            except RecordingError as error:
                bad.append(LeftOut(self._path.name, self._lines[k], str(error), cell))
                if len(bad) > MAX_BAD_CELLS * len(cells):
                    msg = f"{self._path}: line {bad[0].line}, {bad[0].why}"
                    raise RecordingError(msg) from error
        self._left_out += bad
        return numbers

    def _read_dates(self, name: str) -> bool:
        """Read a column of dates with times of day; return whether it is one."""
        cells = self._cells.get(name, ())
        if isinstance(cells, np.ndarray) or not len(cells) or not _DATE.match(cells[0]):
            return False
        with suppress(ValueError):
            since = np.array([_instant(cell) for cell in cells], "datetime64[ns]")
            self._ticks[name] = since.astype(np.int64), NS_PER_S
            return True
        return False


def refuse_large(size: int, path: Path, what: str = "") -> None:
    """Refuse what would not fit into memory beside its numbers.

    Args:
        size: Unpacked [bytes].
        path: Of the file.
        what: What of it, where it is not the whole file.

    Raises:
        RecordingError: when it is larger than `MAX_BYTES`.
    """
    if size > MAX_BYTES:
        msg = f"{path}: {what}holds more than {MAX_BYTES >> 20} MiB: split it"
        raise RecordingError(msg)


def refuse_unequal(columns: Mapping[str, Collection[object]], path: Path) -> None:
    """Refuse columns that cannot be rows of one table.

    Raises:
        RecordingError: when they differ in length.
    """
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        msg = f"{path}: columns of different lengths: {lengths}"
        raise RecordingError(msg)


def _instant(cell: str) -> np.datetime64:
    """Return a date and time of day; without a zone it counts as UTC, without a date from 1970.

    Raises:
        ValueError: when it is none.
    """
    text = cell.strip().replace("/", "-").removesuffix("Z")
    text = text if "-" in text[:5] else f"1970-01-01T{text}"
    if _ZONE.search(text[10:]):
        return np.datetime64(datetime.fromisoformat(text).astimezone(UTC).replace(tzinfo=None))
    return np.datetime64(text, "ns")


def number(cell: str, where: str) -> float:
    """Return a cell as a number; an empty one, or a word for it, is NaN.

    Raises:
        RecordingError: naming `where`, when it is none.
    """
    text = cell.strip()
    try:
        value = WORDS.get(text.lower())
        return float(text.replace("_", "?")) if value is None else value
    except ValueError as cause:
        is_comma = _DECIMAL_COMMA.fullmatch(text) is not None
        expected = "a decimal point: other cells have points" if is_comma else "a number"
        msg = f"{where}: got {text[:40]!r}, expected {expected}"
        raise RecordingError(msg) from cause
