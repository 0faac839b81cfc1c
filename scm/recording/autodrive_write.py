"""Writes cars and lights in the format of AutoDRIVE's data recorder.

One row per stamp, with the same stamps for all cars. There are no rows in gaps of the poses; cells
of unknown values are empty.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import RecordingError
from scm.recording.autodrive import (
    CAR,
    EULER,
    PICTURES,
    POSITION,
    SCAN,
    cell_of,
    log_name,
    picture_name,
    stamp_of,
)

RATE_HZ = 30.0
LONGEST_GAP_S = 0.25  # of poses, as for a replay
LONGEST_HELD_S = 0.5  # a scan or a picture that is older is not shown
FASTEST_HZ = 1000.0  # stamps are whole milliseconds
COUNTS = ("leftTicks", "rightTicks")
BETWEEN = (*POSITION[:2], *EULER, "speed")  # read between samples; all others hold until the next
BEAMS = 360


class Series(NamedTuple):
    """One quantity: times since the start [s], going forward, and values, both of shape (n,)."""

    t: Floats
    values: Floats


@dataclass(frozen=True, slots=True)
class CarTrack:
    """What is known of one car, by the recorder's columns, in its units and frame.

    Attributes:
        name: What our recording calls it.
        columns: `posX` and `posY` are needed; angles are continuous, not wrapped.
        scan_t, scans: When the LIDAR's scans were made [s], shape (m,), and their ranges [m], shape
            (m, 360), from straight ahead to the left.
        picture_t: When the pictures of each camera were taken [s], 0 front, 1 rear.
    """

    name: str
    columns: Mapping[str, Series]
    scan_t: Floats = field(default_factory=lambda: np.empty(0))
    scans: Floats = field(default_factory=lambda: np.empty((0, BEAMS)))
    picture_t: Mapping[int, Floats] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LightTrack:
    """What one light showed: states 0 to 3 from their times on [s]; `number` is its log's."""

    number: int
    name: str
    states: Series


@dataclass(frozen=True, slots=True)
class Written:
    """One log that was written.

    Attributes:
        file: Its name.
        of: Whose it is, as our recording calls it.
        rows: How many.
        empty: Columns that nothing is known of.
        pictures: Of each camera, by the number of a picture, where it belongs in the folder.
    """

    file: str
    of: str
    rows: int
    empty: tuple[str, ...] = ()
    pictures: Mapping[int, Mapping[int, str]] = field(default_factory=dict)


def write_logs(
    out: Path,
    cars: Sequence[CarTrack],
    lights: Sequence[LightTrack] = (),
    *,
    start_ms: int,
    rate_hz: float = RATE_HZ,
) -> list[Written]:
    """Write the logs of cars and lights; pictures are the caller's to put in place.

    Args:
        out: Folder to write; it must be new, or empty.
        cars: Numbered from 1 in their order.
        lights: With numbers of their own.
        start_ms: When all times start, in milliseconds since 1970.
        rate_hz: Rows a second.

    Raises:
        RecordingError: when `out` is in use, there is no car, or the rate is none.
    """
    if not 0.0 < rate_hz <= FASTEST_HZ:
        msg = f"rate: got {rate_hz:g} Hz, expected above 0 and up to {FASTEST_HZ:g}"
        raise RecordingError(msg)
    if not cars:
        msg = f"{out}: no car to write"
        raise RecordingError(msg)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        msg = f"{out}: is there already: a recording is never written over"
        raise RecordingError(msg)
    out.mkdir(parents=True, exist_ok=True)
    known = [car.columns["posX"].t for car in cars]
    ms = _grid_ms(known, rate_hz)
    stamps = [stamp_of(start_ms + int(at)) for at in ms]
    t: Floats = ms / 1000.0
    written = [_write_car(out, i, car, t, stamps) for i, car in enumerate(cars, start=1)]
    return written + [_write_light(out, light, t, stamps) for light in lights]


def _grid_ms(known: Sequence[Floats], rate_hz: float) -> Ints:
    """Return the stamps [ms] from the first pose on, less those at which no car is known."""
    first_ms = math.ceil(min(float(t[0]) for t in known) * 1000.0 - 1e-6)
    found = []
    for t in known:
        ends = np.flatnonzero(np.diff(t) > LONGEST_GAP_S)
        starts = np.concatenate(([0], ends + 1))
        for start, end in zip(t[starts], t[np.append(ends, len(t) - 1)], strict=True):
            low = math.floor((start * 1000.0 - first_ms) * rate_hz / 1000.0) - 1
            high = math.ceil((end * 1000.0 - first_ms) * rate_hz / 1000.0) + 1
            found.append(first_ms + np.round(np.arange(max(low, 0), high + 1) * 1000.0 / rate_hz))
    ms = np.unique(np.concatenate(found)).astype(np.int64)
    return ms[np.any([_is_known(t, ms / 1000.0) for t in known], axis=0)]


def _write_car(out: Path, number: int, car: CarTrack, t: Floats, stamps: list[str]) -> Written:
    """Write the log of one car."""
    there = np.flatnonzero(_is_known(car.columns["posX"].t, t))
    at = t[there]
    cells = {name: _cells(name, car.columns.get(name), at) for name in CAR[1:]}
    own = [stamps[k] for k in there]
    pictures: dict[int, dict[int, str]] = {}
    if len(car.scan_t) or any(map(len, car.picture_t.values())):
        for camera, name in enumerate(PICTURES):
            shown = _newest(car.picture_t.get(camera, np.empty(0)), at)
            cells[name], pictures[camera] = _picture_cells(number, camera, shown, own)
        newest = _newest(car.scan_t, at)
        texts = [" ".join(map(_range_of, scan)) for scan in car.scans]
        cells[SCAN] = ["" if k < 0 else texts[k] for k in newest]
    rows = zip(own, *cells.values(), strict=True)
    file = log_name("V", number)
    text = "".join(f"{','.join(row)}\n" for row in rows)
    (out / file).write_text(text, encoding="utf-8", newline="")
    empty = tuple(name for name, column in cells.items() if not any(column))
    return Written(file, car.name, len(own), empty, pictures)


def _write_light(out: Path, light: LightTrack, t: Floats, stamps: list[str]) -> Written:
    """Write the log of one light, from its first state on."""
    file = log_name("TL", light.number)
    k = np.searchsorted(light.states.t, t, "right") - 1
    rows = [
        f"{stamp},{int(light.states.values[i])}\n"
        for stamp, i in zip(stamps, k, strict=True)
        if i >= 0
    ]
    (out / file).write_text("".join(rows), encoding="utf-8", newline="")
    return Written(file, light.name, len(rows))


def _is_known(known_t: Floats, t: Floats) -> Bools:
    """Say at which times a pose is known: not before, not after, not in a gap, shape of `t`."""
    k = np.searchsorted(known_t, t, "right")
    before, after = known_t[np.maximum(k - 1, 0)], known_t[np.minimum(k, len(known_t) - 1)]
    there: Bools = (k > 0) & (t <= known_t[-1]) & (after - before <= LONGEST_GAP_S)
    return there | np.isin(t, known_t)


def _cells(name: str, series: Series | None, t: Floats) -> list[str]:
    """Return the cells of one column at some times."""
    if series is None or not len(series.t):
        return [""] * len(t)
    if name in BETWEEN:
        values = np.interp(t, series.t, series.values, left=np.nan, right=np.nan)
    else:
        k = np.searchsorted(series.t, t, "right") - 1
        values = np.where(k < 0, np.nan, series.values[np.maximum(k, 0)])
    if name in EULER:
        values %= 2.0 * np.pi
    if name in COUNTS:
        return ["" if math.isnan(value) else str(round(value)) for value in values]
    return [cell_of(value) for value in values]


def _newest(known_t: Floats, t: Floats) -> Ints:
    """Return the newest of some instants at each time, -1 where it is none or too old."""
    k = np.searchsorted(known_t, t, "right") - 1
    if not len(known_t):
        return np.full(len(t), -1)
    return np.where((k >= 0) & (t - known_t[np.maximum(k, 0)] <= LONGEST_HELD_S), k, -1)


def _picture_cells(
    number: int, camera: int, shown: Ints, stamps: Sequence[str]
) -> tuple[list[str], dict[int, str]]:
    """Return the cells of a camera's column, and where each picture belongs.

    A picture is named after the first row that shows it.
    """
    names: dict[int, str] = {}
    cells = []
    for k, stamp in zip(shown.tolist(), stamps, strict=True):
        if k >= 0:
            names.setdefault(k, picture_name(number, camera, stamp))
        cells.append(names.get(k, ""))
    return cells, names


def _range_of(value: float) -> str:
    return "inf" if math.isinf(value) else cell_of(value) or "nan"
