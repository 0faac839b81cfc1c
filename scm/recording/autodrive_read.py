"""Reads AutoDRIVE's logs as columns of cells; invalid rows are kept separately, not lost."""

import csv
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import RecordingError
from scm.recording.autodrive import (
    CAR,
    CAR_LAYOUTS,
    EULER,
    GREEN,
    LIGHT_LAYOUTS,
    MOTION,
    OFF,
    PICTURES,
    POSITION,
    SCAN,
    STAMP,
    stamp_ms,
)
from scm.recording.columns import LeftOut, refuse_large

_LOG = re.compile(r"(V|TL)(\d+) Log\.csv")
_PICTURE = re.compile(r"\.jpe?g\s*$", re.IGNORECASE)
TICKS = ("leftTicks", "rightTicks")
STATES = range(OFF, GREEN + 1)
FEW_ROWS, FEW_SHARE = 3, 0.01  # with fractions of a count: more, and the column is no counter
FEWEST_ZEROS = 6  # measured values that are 0 at once by design, not by chance
NEAR_M, NEAR_RAD = 0.03, 0.05  # a car that drives off from where it stood; its axle is higher up
PLACEHOLDER_MS, LEAP_M = 1000, 0.1
FASTER, FASTEST_MPS = (
    3.0,
    20.0,
)  # than the log's own speed; no scaled car is faster, where it has none
MISSES = ("inf", "infinity", "∞")
NUMBERS = {name for layout in CAR_LAYOUTS.values() for name in layout} - {STAMP, SCAN, *PICTURES}
Layouts = Mapping[int, tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Log:
    """One file of the recorder.

    Attributes:
        path: Of the file.
        kind, number: `V` or `TL`, and which.
        cells: Of each column but the LIDAR's the cells as they stand in the file, by row.
        lines: Where each row stands in the file.
        stamps_ms: Of each row, since 1970, shape (rows,).
        scans: LIDAR ranges [m], shape (rows, beams): infinite for a miss, NaN where there is no
            scan; None: no row has one.
        left_out: Lines that are no rows, or hold what was measured before the first measurement.
    """

    path: Path
    kind: str
    number: int
    cells: dict[str, list[str]]
    lines: list[int]
    stamps_ms: Ints
    scans: Floats | None
    left_out: list[LeftOut]

    @property
    def name(self) -> str:
        """`V1` or `TL1`."""
        return f"{self.kind}{self.number}"

    def numbers(self, column: str) -> Floats:
        """Return a column as numbers, shape (rows,); NaN where a cell is empty or it is missing."""
        cells = self.cells.get(column, [""] * len(self.lines))
        return np.array([float(cell) if cell else math.nan for cell in cells])

    def is_counter(self, column: str) -> bool:
        """Return whether a column holds whole numbers, as the counts of an encoder are."""
        return not _has_fraction(self.numbers(column)).any()


def read_logs(folder: Path) -> list[Log]:
    """Read all logs of cars and lights in a folder, cars first, by number.

    Raises:
        RecordingError: when there is no car's log, or one that has no row of the recorder's.
    """
    if not folder.is_dir():
        msg = f"{folder}: no such folder"
        raise RecordingError(msg)
    found = [(path, match) for path in folder.iterdir() if (match := _LOG.fullmatch(path.name))]
    if not any(match[1] == "V" for _, match in found):
        inside = sorted({path.parent.name for path in folder.glob("*/V* Log.csv")})
        hint = f"; there are in {', '.join(inside[:5])}: import each by itself" if inside else ""
        msg = f"{folder}: no log of a car: expected 'V1 Log.csv' in it{hint}"
        raise RecordingError(msg)
    found.sort(key=lambda one: (one[1][1] == "TL", int(one[1][2])))
    return [read_log(path, match[1], int(match[2])) for path, match in found]


def read_log(path: Path, kind: str, number: int) -> Log:
    """Read one log.

    Raises:
        RecordingError: when it has no row of the recorder's, with what is wrong with the first.
    """
    refuse_large(path.stat().st_size, path)
    text = path.read_bytes().decode("utf-8-sig", errors="backslashreplace")
    lines = [(i, line.rstrip("\r")) for i, line in enumerate(text.split("\n"), start=1)]
    rows = [(i, line, _cells(line)) for i, line in lines if line.strip()]
    layout, rows = _layout(path, rows, CAR_LAYOUTS if kind == "V" else LIGHT_LAYOUTS)
    reader = _Rows(path, layout, kind)
    for i, line, cells in rows:
        reader.pop_row(i, line, cells)
    if not reader.lines:
        why = "".join(f": line {one.line}: {one.why}" for one in reader.left_out[:1])
        msg = f"{path}: no row of AutoDRIVE's recorder{why}"
        raise RecordingError(msg)
    if len(reader.left_out) > len(reader.lines):
        first, bad = reader.left_out[0], len(reader.left_out)
        msg = (
            f"{path}: {bad} of {bad + len(reader.lines)} rows are none of AutoDRIVE's recorder: "
            f"line {first.line}: {first.why}; are decimals written with a comma?"
        )
        raise RecordingError(msg)
    scans = reader.all_scans()
    stamps = np.array(reader.stamps_ms, np.int64)
    log = Log(path, kind, number, reader.cells, reader.lines, stamps, scans, reader.left_out)
    for placeholders in (_fractions, _zeros, _leap) if kind == "V" else ():
        found = placeholders(log)
        if found:
            texts = {i: line for i, line, _ in rows if i in {log.lines[k] for k in found}}
            log = _without(log, found, texts)
    return log


def _without(log: Log, found: Mapping[int, str], texts: Mapping[int, str]) -> Log:
    """Return a log without some rows, left out for the reasons given."""
    keep = [k for k in range(len(log.lines)) if k not in found]
    left_out = [
        LeftOut(log.path.name, log.lines[k], why, texts[log.lines[k]]) for k, why in found.items()
    ]
    return replace(
        log,
        cells={name: [cells[k] for k in keep] for name, cells in log.cells.items()},
        lines=[log.lines[k] for k in keep],
        stamps_ms=log.stamps_ms[keep],
        scans=None if log.scans is None else log.scans[keep],
        left_out=sorted([*log.left_out, *left_out], key=lambda one: one.line or 0),
    )


def _fractions(log: Log) -> dict[int, str]:
    """Return the rows in which an encoder has a fraction of a count, where few rows have one.

    The recorder begins with placeholders. A column that is not whole elsewhere is no counter.
    """
    found: dict[int, str] = {}
    for name in TICKS:
        values = log.numbers(name)
        odd = _has_fraction(values)
        first = int(np.argmin(odd)) if odd.any() and not odd.all() else 0
        few = max(FEW_ROWS, FEW_SHARE * len(odd))
        if first <= len(odd) // 2 and odd[first:].sum() <= few and not odd.all():
            for k in np.flatnonzero(odd).tolist():
                why = f"{name}: got {values[k]:g}, expected whole counts of an encoder"
                found.setdefault(k, why)
    return found


def _has_fraction(values: Floats) -> Bools:
    has_fraction: Bools = np.isfinite(values) & (values != np.rint(values))
    return has_fraction


def _zeros(log: Log) -> dict[int, str]:
    """Return the first rows where every measured value is 0 and the next row is somewhere else."""
    measured = _columns(log, MOTION)
    zeros = (np.nan_to_num(measured) == 0.0).all(axis=0)
    zeros &= np.isfinite(measured).sum(axis=0) >= FEWEST_ZEROS
    ends = np.flatnonzero(~zeros)
    if not len(ends) or ends[0] == 0:
        return {}
    next_row = int(ends[0])
    place = np.nan_to_num(_columns(log, POSITION)[:, next_row])
    turn = np.nan_to_num(_columns(log, EULER)[:, next_row])
    turned = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    if np.hypot.reduce(place) < NEAR_M and turned.max() < NEAR_RAD:
        return {}
    return dict.fromkeys(range(next_row), "a placeholder: every measured value is 0")


def _leap(log: Log) -> dict[int, str]:
    """Return the first rows whose place is one from which the car cannot be at the next."""
    place = _columns(log, POSITION[:2])
    moves = np.flatnonzero((place != place[:, :1]).any(axis=0))
    if not len(moves) or log.stamps_ms[moves[0]] - log.stamps_ms[0] > PLACEHOLDER_MS:
        return {}
    first = int(moves[0])
    step_m = float(np.hypot(*(place[:, first] - place[:, 0])))
    step_s = max(1, int(log.stamps_ms[first] - log.stamps_ms[first - 1])) / 1000.0
    fastest = float(np.nanmax(np.abs(log.numbers("speed")), initial=0.0))
    if not step_m > LEAP_M + (FASTER * fastest or FASTEST_MPS) * step_s:
        return {}
    why = f"a placeholder: the next row is {step_m:.2f} m away, {step_s:.3f} s later"
    return dict.fromkeys(range(first), why)


def _columns(log: Log, names: Sequence[str]) -> Floats:
    """Return columns as numbers, shape (columns, rows)."""
    return np.array([log.numbers(name) for name in names])


Row = tuple[int, str, list[str]]


def _layout(path: Path, rows: list[Row], layouts: Layouts) -> tuple[tuple[str, ...], list[Row]]:
    """Return which columns a file has, by its header or by the cells of its rows, and its rows."""
    if not rows:
        msg = f"{path}: empty"
        raise RecordingError(msg)
    known = {name.lower(): name for layout in layouts.values() for name in layout}
    first = [cell.strip() for cell in rows[0][2]]
    if STAMP in [cell.lower() for cell in first]:
        names = tuple(known.get(cell.lower(), cell) for cell in first)
        doubled = [name for name, count in Counter(names).items() if count > 1]
        if doubled:
            msg = f"{path}: line {rows[0][0]}: columns named twice: {', '.join(doubled)}"
            raise RecordingError(msg)
        return names, rows[1:]
    widths = Counter(len(cells) for _, _, cells in rows).most_common()
    for width, count in widths:
        is_common = 2 * count >= len(rows)
        if width in layouts and is_common and _shows_pictures(layouts[width], rows):
            return layouts[width], rows
    pictures = max(line.lower().count(".jpg,") for _, line, _ in rows)
    if pictures and len(CAR) + 1 + pictures in layouts:
        return layouts[len(CAR) + 1 + pictures], rows
    msg = (
        f"{path}: line {rows[0][0]}: {widths[0][1]} of {len(rows)} rows have {widths[0][0]} cells, "
        f"expected {', '.join(map(str, layouts))} or a header with {STAMP!r}; are decimals written "
        "with a comma?"
    )
    raise RecordingError(msg)


def _shows_pictures(layout: tuple[str, ...], rows: Sequence[Row]) -> bool:
    """Say whether, where pictures should be, there are: a comma in a path shifts them."""
    cells = next(cells for _, _, cells in rows if len(cells) == len(layout))
    columns = [cells[k] for k, name in enumerate(layout) if name in PICTURES]
    return all(_PICTURE.search(cell) for cell in columns if cell.strip())


class _Rows:
    """Takes lines one by one, and sets aside those that are no rows."""

    def __init__(self, path: Path, layout: tuple[str, ...], kind: str) -> None:
        self._path, self._layout, self._is_light = path, layout, kind == "TL"
        self._beams = 0
        self._scans: list[Floats | None] = []
        self.cells: dict[str, list[str]] = {name: [] for name in layout if name != SCAN}
        self.lines: list[int] = []
        self.stamps_ms: list[int] = []
        self.left_out: list[LeftOut] = []

    def pop_row(self, line: int, text: str, cells: list[str]) -> None:
        """Note a line as a row, or set it aside."""
        try:
            named = self._named(cells)
            at_ms = stamp_ms(named[STAMP])
            scan = self._scan(named.get(SCAN, ""))
        except RecordingError as problem:
            self.left_out.append(LeftOut(self._path.name, line, str(problem), text))
            return
        for name, usable in self.cells.items():
            usable.append(named[name])
        self.lines.append(line)
        self.stamps_ms.append(at_ms)
        self._scans.append(scan)

    def all_scans(self) -> Floats | None:
        """Return the scans of all rows, shape (rows, beams)."""
        if not self._beams:
            return None
        none = np.full(self._beams, np.nan)
        return np.array([none if scan is None else scan for scan in self._scans])

    def _named(self, cells: Sequence[str]) -> dict[str, str]:
        """Return the cells of a row by column, numbers checked."""
        cells = [cell.strip() for cell in self._joined(cells)]
        if len(cells) != len(self._layout):
            msg = f"got {len(cells)} cells, expected {len(self._layout)}"
            raise RecordingError(msg)
        named = dict(zip(self._layout, cells, strict=True))
        for name, cell in named.items():
            if name in NUMBERS and not _is_number(cell):
                msg = f"{name}: got {cell[:40]!r}, expected a number"
                raise RecordingError(msg)
        if self._is_light and not _is_state(named.get("state", "")):
            msg = f"state: got {named.get('state')!r}, expected {OFF} to {GREEN}"
            raise RecordingError(msg)
        return named

    def _joined(self, cells: Sequence[str]) -> Sequence[str]:
        """Return the cells with each path of a picture in one, though it has commas in it."""
        if len(cells) <= len(self._layout):
            return cells
        left, joined = list(cells), []
        for name in self._layout:
            cell = left.pop(0) if left else ""
            while name in PICTURES and cell and left and not _PICTURE.search(cell):
                cell += "," + left.pop(0)
            joined.append(cell)
        return joined + left

    def _scan(self, text: str) -> Floats | None:
        """Return the ranges of a cell of the LIDAR's column."""
        words = text.split()
        if not words:
            return None
        try:
            scan = np.array([math.inf if w.lower() in MISSES else float(w) for w in words])
        except ValueError as cause:
            msg = f"{SCAN}: {cause}, expected ranges [m]"
            raise RecordingError(msg) from cause
        self._beams = self._beams or len(scan)
        if len(scan) != self._beams:
            msg = f"{SCAN}: got {len(scan)} ranges, expected {self._beams} as above"
            raise RecordingError(msg)
        return scan


def _cells(line: str) -> list[str]:
    """Return the cells of a line; the recorder quotes none, tables saved anew may."""
    try:
        return next(csv.reader([line]), [])
    except csv.Error:
        return line.split(",")


def _is_state(cell: str) -> bool:
    """Return whether a cell is a light's state, be it saved anew as a decimal."""
    return bool(cell) and _is_number(cell) and float(cell) in STATES


def _is_number(cell: str) -> bool:
    try:
        float(cell or "0")
    except ValueError:
        return False
    return "_" not in cell
