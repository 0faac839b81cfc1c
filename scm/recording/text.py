"""Text tables as columns: CSV, TSV, tables separated by blanks, trajectories in TUM format.

Separator, header line and number of cells are detected from the lines. Invalid lines are left out
and recorded.
"""

import codecs
import csv
import gzip
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.columns import Columns, LeftOut, Selection, refuse_large

SEPARATORS = (",", ";", "\t", "|", " ")
COMMENTS = "#%"
BLANK = " \t,;|"  # a line of nothing else is empty: spreadsheets write such below a table
FEWEST_COUNTED = 3  # rows that show that the first cells count the rows
TUM = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
MAX_ABOVE = 30  # lines above the rows; exports of motion capture have seven
MAX_SAMPLE = 60  # lines that what parts the cells is chosen by
MAX_IN_QUOTES = (
    20  # lines that one quoted cell spans; a quote that is never closed ends with its line
)
MAX_CONTROLS = 0.02  # of the characters at the begin of a text
SHOWN = 80  # characters of a line in a message
GZIP = b"\x1f\x8b"
PIECE_BYTES = 1 << 20
PIECE_ROWS = 4096  # read at once: their cells as objects take a few MB
_NUMBER = re.compile(
    r"\s*[+-]?((\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|nan|inf(inity)?)\s*", re.IGNORECASE
)
_COMMA, _POINT = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*"), re.compile(r"\s*[+-]?\d*\.\d.*")
EXCEL = re.compile(r"sep=.", re.IGNORECASE)  # a first line that is for a spreadsheet
_NUMBERS = msgspec.json.Decoder(list[float])
_CONTROLS = re.compile(r"[\x01-\x08\x0b\x0e-\x1f\x7f]")


class Line(NamedTuple):
    """A line that is neither empty nor a comment, and its place in the file, from 1."""

    number: int
    text: str


def read(path: Path, selection: Selection) -> Columns:
    """Return the columns of a text table.

    Raises:
        RecordingError: naming the line, when it has no names, no common width, or is no text.
    """
    csv.field_size_limit(max(csv.field_size_limit(), limits.MAX_BYTES))  # of the whole process
    text, is_cut = _text(path)
    return _Table(path, text, selection, is_cut=is_cut).columns()


def _text(path: Path) -> tuple[str, bool]:
    """Return a file's text, and whether it is cut off."""
    data, is_cut = _unpacked(path)
    return _decoded(data, path), is_cut


def _unpacked(path: Path) -> tuple[bytes, bool]:
    """Return what is in a file, unpacked if it is gzipped, and whether it is cut off."""
    with path.open("rb") as stream:
        is_packed = stream.read(len(GZIP)) == GZIP
        if not is_packed:
            stream.seek(0)
            data = stream.read(limits.MAX_BYTES + 1)
            refuse_large(len(data), path)
            return data, False
    pieces, size = [], 0
    with gzip.open(path) as packed:
        try:
            while piece := packed.read1(PIECE_BYTES):
                size += len(piece)
                refuse_large(size, path)
                pieces.append(piece)
        except EOFError:
            return b"".join(pieces), True
    return b"".join(pieces), False


def _decoded(data: bytes, path: Path) -> str:
    """Return a file's text: by its byte order mark, or UTF-8, or else latin-1."""
    marks = {
        codecs.BOM_UTF8: "utf-8-sig",
        codecs.BOM_UTF32_LE: "utf-32",
        codecs.BOM_UTF16_LE: "utf-16",
        codecs.BOM_UTF16_BE: "utf-16",
    }
    encoding = next((name for mark, name in marks.items() if data.startswith(mark)), "")
    begin = data[:1024]
    for name, first in (("utf-16-le", 0), ("utf-16-be", 1)):
        if not encoding and begin and not any(begin[1 - first :: 2]) and all(begin[first::2]):
            encoding = name
    try:
        text = data.decode(encoding or "utf-8", errors="replace" if encoding else "strict")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    begun = text[:4096]
    if len(_CONTROLS.findall(begun)) > MAX_CONTROLS * len(begun):
        msg = f"{path}: not a text table: it holds control characters, as binary files do"
        raise RecordingError(msg)
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


class _Table:
    """A text on its way to being columns.

    Lines that may be rows are called by their index; `_texts` holds them, `_places` where each
    stands in the file, `_widths` how many cells it has.
    """

    def __init__(self, path: Path, text: str, selection: Selection, *, is_cut: bool) -> None:
        self._path, self._selection = path, selection
        self._left_out: list[LeftOut] = []
        self._comment, self._is_tangled = "", False
        self._has_quotes, self._has_commas = '"' in text, "," in text
        texts = text.split("\n")
        if is_cut:
            self._leave_out(Line(len(texts), texts.pop()), "the file is cut off here")
        self._texts, self._places = self._without_comments(texts, has_nul="\0" in text)
        if not self._texts:
            msg = f"{path}: no rows{' below the header' if self._comment else ''}"
            raise RecordingError(msg)
        self._separator = _separator(self._texts[:MAX_SAMPLE])
        self._widths = self._measured()

    def columns(self) -> Columns:
        """Return the columns.

        Raises:
            RecordingError: when the lines have no names, or no common width.
        """
        width = self._common_width()
        names, first = self._named(width)
        is_even = set(self._widths[first:]) == {width}
        rows = range(first, len(self._texts)) if is_even else self._of_width(width, first)
        if not rows:
            msg = f"{self._path}: no rows below the header"
            raise RecordingError(msg)
        names = self._fitted(names, width, rows)
        wanted = self._selection.wanted
        picked = [k for k, name in enumerate(names) if wanted is None or name in wanted]
        chosen = [names[k] for k in picked]
        self._left_out.sort(key=lambda one: one.line or 0)
        texts = [self._texts[i] for i in rows]
        numbers = self._numbers(texts, width, picked) if picked else []
        places = [self._places[i] for i in rows] if self._left_out or numbers is None else ()
        if numbers is not None:
            return Columns(
                self._path, chosen, numbers, places, known=names, left_out=self._left_out
            )
        words = self._words(texts, picked)
        return Columns(self._path, chosen, words, places, known=names, left_out=self._left_out)

    def _leave_out(self, line: Line, why: str) -> None:
        text = line.text.replace("\0", "")[:SHOWN]
        self._left_out.append(LeftOut(self._path.name, line.number, why, text))

    def _line(self, i: int) -> Line:
        return Line(self._places[i], self._texts[i])

    def _cells_of(self, i: int) -> list[str]:
        return _cells(self._texts[i], self._separator)

    def _of_width(self, width: int, first: int) -> list[int]:
        """Return the rows of a width; others are left out."""
        rows = []
        for i in range(first, len(self._texts)):
            if self._widths[i] == width:
                rows.append(i)
            else:
                got = f"{self._widths[i]} cell{'s' if self._widths[i] != 1 else ''}"
                self._leave_out(self._line(i), f"{got}, expected {width} as most lines have")
        return rows

    def _without_comments(
        self, texts: list[str], *, has_nul: bool
    ) -> tuple[list[str], Sequence[int]]:
        """Return the lines that may be rows and their places; keep the last comment above them."""
        unclear = {"", " ", *SEPARATORS, *COMMENTS}  # how lines begin that may be none
        others: set[int] = set()
        comment = -1
        if EXCEL.fullmatch(texts[0]):
            others.add(0)
        for i in [i for i, text in enumerate(texts) if text[:1] in unclear]:
            if not texts[i].strip(BLANK):
                others.add(i)
            elif texts[i].lstrip()[0] in COMMENTS:
                others.add(i)
                comment = i if len(others) == i + 1 else comment
        if comment >= 0:
            self._comment = texts[comment].lstrip(f"{COMMENTS} \t").rstrip()
        if has_nul:
            for i in [i for i, text in enumerate(texts) if "\0" in text]:
                others.add(i)
                self._leave_out(Line(i + 1, texts[i]), "NUL bytes, as a power cut leaves them")
        places: Sequence[int] = range(1, len(texts) + 1)
        if others:
            places = [i + 1 for i in range(len(texts)) if i not in others]
            texts = [texts[place - 1] for place in places]
        if self._has_quotes and any(text.count('"') % 2 for text in texts):
            joined = list(_joined([Line(*one) for one in zip(places, texts, strict=True)]))
            texts, places = [line.text for line in joined], [line.number for line in joined]
        return texts, places

    def _measured(self) -> list[int]:
        """Return how many cells each row has."""
        if self._separator != " " and not self._has_quotes:
            separator = self._separator
            return [text.count(separator) + 1 for text in self._texts]
        widths = [len(cells) for cells in self._parsed(self._texts)]
        if len(widths) != len(self._texts):  # a quote within a cell joins lines
            self._is_tangled = True
            widths = [len(cells) for cells in self._parsed(self._texts)]
        return widths

    def _parsed(self, texts: Sequence[str]) -> Iterator[list[str]]:
        """Yield the cells of lines: as `_cells` does, but all at once."""
        separator = self._separator
        if not self._has_quotes or self._is_tangled:
            return (_cells(text, separator) for text in texts)
        lines = (text.strip() for text in texts) if separator == " " else texts
        return iter(csv.reader(lines, delimiter=separator, skipinitialspace=True))

    def _common_width(self) -> int:
        """Return how many cells most lines have."""
        is_named = self._selection.columns is None and not self._comment
        counts = Counter(self._widths[is_named:] or self._widths)  # without the line of names
        width, most = counts.most_common(1)[0]
        if 2 * most < len(self._widths) - min(MAX_ABOVE, len(self._widths) // 2):
            cells = ", ".join(f"{n} of {cells}" for cells, n in counts.most_common(4))
            msg = (
                f"{self._path}: no common width: of {len(self._widths)} lines {cells} cells; "
                "expected one row a line, its cells parted by commas, semicolons, tabs or blanks"
            )
            raise RecordingError(msg)
        return width

    def _named(self, width: int) -> tuple[list[str], int]:
        """Return the names of the columns, and which of the lines is the first row."""
        above, given = self._above(width), self._selection.columns
        fits = [i for i in range(above) if self._widths[i] == width]
        if given is not None:
            named = [i for i in fits if not _count_numbers(self._cells_of(i))]
            if named:
                line = self._line(named[0])
                msg = (
                    f"{self._path}: line {line.number}: got names ({line.text[:SHOWN]!r}), "
                    "expected a row: take `columns:` out of the table, or this line out of the file"
                )
                raise RecordingError(msg)
            return [name or "" for name in given], 0
        if above == 0:
            return self._named_by_comment(width), 0
        header, names = self._header(fits or [above - 1], width)
        for i in range(header):
            self._leave_out(self._line(i), "above the names of the columns")
        first = header + 1
        while first < above and not _count_numbers(self._cells_of(first)):
            self._leave_out(self._line(first), "no numbers: units of the columns?")
            first += 1
        return names, first

    def _header(self, lines: Sequence[int], width: int) -> tuple[int, list[str]]:
        """Return which of some lines gives the most names, the first of equals, and its names."""
        best, found = lines[0], list[str]()
        for i in lines:
            names = _names(self._texts[i], self._separator, width)
            if len({*names} - {""}) > len({*found} - {""}):
                best, found = i, names
        return best, found

    def _above(self, width: int) -> int:
        """Return how many lines stand above the first that is clearly a row of numbers."""
        for i in range(min(MAX_ABOVE, len(self._texts))):
            cells = [cell for cell in self._cells_of(i) if cell.strip()]
            if self._widths[i] == width and 2 * _count_numbers(cells) >= max(1, len(cells)):
                return i
        return 1

    def _named_by_comment(self, width: int) -> list[str]:
        """Return the names that a comment above the rows gives, or the format."""
        names = _names(self._comment, self._separator, width)
        if self._comment and len(names) == width:
            return names
        if ".tum" in self._path.name.lower() and width == len(TUM):
            return list(TUM)
        msg = (
            f"{self._path}: line {self._places[0]}: got numbers, expected the names of the columns:"
            f" name all {width} in the table, as `columns: [t, x, ...]`; ~ for one nobody needs"
        )
        raise RecordingError(msg)

    def _fitted(self, names: list[str], width: int, rows: Sequence[int]) -> list[str]:
        """Return one name for each cell of a row, empty where a cell has none."""
        fitted, cells = list(names), width
        if len(fitted) != cells and self._separator != " ":
            if all(self._texts[i].rstrip(" ").endswith(self._separator) for i in rows):
                cells -= 1
            if fitted and not fitted[-1]:
                fitted.pop()
        if cells == len(fitted) + 1 and self._selection.columns is None and self._has_index(rows):
            fitted.insert(0, "")
        if len(fitted) == cells:
            return fitted + [""] * (width - cells)
        more = ""
        if self._separator == "," and width > len(names):
            more = "; are these decimal commas? write points, or part the cells by semicolons"
        total = len(self._texts) - (self._selection.columns is None and not self._comment)
        msg = (
            f"{self._path}: line {self._places[rows[0]]}: {width} cells, as {len(rows)} of {total} "
            f"lines have, but names for {len(names)} columns ({', '.join(names)[:SHOWN]}){more}"
        )
        raise RecordingError(msg)

    def _has_index(self, rows: Sequence[int]) -> bool:
        """Say whether the first cells of the rows count up, most of them by one."""
        firsts = [self._cells_of(i)[0].strip() for i in rows]
        if len(firsts) < FEWEST_COUNTED or not all(first.isdecimal() for first in firsts):
            return False
        steps = [int(after) - int(before) for before, after in pairwise(firsts)]
        return min(steps) > 0 and 2 * steps.count(1) > len(steps)

    def _numbers(self, rows: list[str], width: int, picked: Sequence[int]) -> list[Floats] | None:
        """Return columns as numbers, None where some of their cells are none."""
        separator = None if self._separator == " " else self._separator
        if self._has_quotes:
            if any(row.count(separator or " ") + 1 != width or "\n" in row for row in rows):
                return None
            rows = [row.replace('"', "") for row in rows]  # they only enclose cells
        if self._separator != "," and self._has_commas and any("," in row for row in rows):
            if any("." in row for row in rows):
                return None
            rows = [row.replace(",", ".") for row in rows]
        try:
            cells = _loaded(rows, separator, picked)
        except ValueError:
            if separator is None:
                return None
            try:
                cells = _loaded(_with_nan(rows, separator), separator, picked)
            except ValueError:
                return None
        return list(np.ascontiguousarray(cells.T))

    def _words(self, rows: Sequence[str], picked: Sequence[int]) -> list[list[str]]:
        """Return columns as they stand: slow, but takes any text."""
        found: list[list[str]] = [[] for _ in picked]
        for cells in self._parsed(rows):
            for k, column in zip(picked, found, strict=True):
                column.append(cells[k])
        has_comma = any(
            _COMMA.fullmatch(cell) for column in found for cell in column if "," in cell
        )
        if not has_comma or any(
            _POINT.fullmatch(c) for column in found for c in column if "." in c
        ):
            return found
        return [
            [c.replace(",", ".") if "," in c and _COMMA.fullmatch(c) else c for c in column]
            for column in found
        ]


def _joined(lines: Sequence[Line]) -> Iterator[Line]:
    """Yield lines, those that end within quotes together with what closes them."""
    i = 0
    while i < len(lines):
        count, last = lines[i].text.count('"'), i
        while count % 2 and last + 1 < min(len(lines), i + MAX_IN_QUOTES):
            last += 1
            count += lines[last].text.count('"')
        if count % 2:  # it is never closed
            last = i
            yield Line(lines[i].number, lines[i].text.replace('"', ""))
        else:
            yield Line(lines[i].number, "\n".join(line.text for line in lines[i : last + 1]))
        i = last + 1


def _separator(sample: Sequence[str]) -> str:
    """Return what parts the cells of some lines: most of equal width, most of numbers."""
    best, chosen = -1.0, ","
    for separator in SEPARATORS:
        rows = [_cells(text, separator) for text in sample]
        width, most = Counter(map(len, rows)).most_common(1)[0]
        if width < 2:
            continue
        cells = [cell for row in rows if len(row) == width for cell in row if cell.strip()]
        score = most / len(rows) * (1 + _count_numbers(cells)) / (1 + len(cells))
        if score > best + 1e-9:
            best, chosen = score, separator
    return chosen


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if '"' in line:
        line = line.strip() if separator == " " else line
        try:
            return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:
            pass
    return line.split() if separator == " " else line.split(separator)


def _names(line: str, separator: str, width: int) -> list[str]:
    """Return the names on a line, which something else may part than the cells below it."""
    parted = [_cells(line, one) for one in (separator, *SEPARATORS)]
    return [name.strip() for name in next((p for p in parted if len(p) == width), parted[0])]


def _count_numbers(cells: Sequence[str]) -> int:
    return sum(_NUMBER.fullmatch(cell) is not None for cell in cells)


def _loaded(rows: Sequence[str], separator: str | None, picked: Sequence[int]) -> Floats:
    """Return some columns of rows of one width as numbers, shape `(rows, columns)`.

    Rows whose cells are numbers as JSON writes them are read as JSON, twice as fast.

    Raises:
        ValueError: when a cell is no number.
    """
    pieces = [rows[i : i + PIECE_ROWS] for i in range(0, len(rows), PIECE_ROWS)]
    return np.concatenate([_piece(piece, separator, picked) for piece in pieces])


def _piece(rows: Sequence[str], separator: str | None, picked: Sequence[int]) -> Floats:
    if separator is not None:
        text = ",".join(rows)
        try:
            cells = _NUMBERS.decode(f"[{text.replace(separator, ',')}]")
        except msgspec.DecodeError:
            pass
        else:
            return np.array(cells, dtype=np.float64).reshape(len(rows), -1)[:, picked]
    return np.loadtxt(rows, delimiter=separator, usecols=picked, ndmin=2, comments=None)


def _with_nan(rows: Sequence[str], separator: str) -> list[str]:
    """Return rows whose empty cells hold the word nan."""
    text, filled = "\n" + "\n".join(rows) + "\n", f"{separator}nan{separator}"
    for _ in range(2):
        text = text.replace(separator * 2, filled)
    text = text.replace(f"\n{separator}", f"\nnan{separator}")
    return text.replace(f"{separator}\n", f"{separator}nan\n").strip("\n").split("\n")
