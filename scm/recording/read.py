"""Reads a recording as channels in SI, each with its own times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.errors import RecordingError
from scm.recording.columns import NS_PER_S, Columns, LeftOut
from scm.recording.description import (
    ChannelColumn,
    Description,
    Table,
    TimeColumn,
    find_description,
    read_description,
)
from scm.recording.expression import columns_of, evaluate
from scm.recording.scans import Scans, read_scans
from scm.recording.shortcuts import SCAN
from scm.recording.table import read_table, refuse_data
from scm.recording.units import UNITS, dimensions_of, factor

RowsOf = tuple[str, str | None, tuple[str | None, ...] | None, str | None]
LONGEST_FROM_ZERO_S = 1e6  # one float holds so many seconds to a nanosecond
TINY_S = 1e-6
SILENCE_S = 0.2  # whoever drives a car commands it oftener
LARGEST_VARIANCE = 1e3  # whoever does not know writes 1e6, 99999 or -1; nothing measures so badly


@dataclass(frozen=True, slots=True)
class Source:
    """Where a channel was read from, so that a message can count rows.

    Attributes:
        table: Its file, with the topic of a bag.
        index: Which table of the description it is: two may share a file.
        rows: How many rows the file has.
        excluded: How many of them the table's `where` excludes.
        numbers: Of the row in which each value stands, from 1, shape `(n,)`.
        time_unit: As the description gives it.
    """

    table: str
    index: int
    rows: int
    excluded: int
    numbers: Ints
    time_unit: str = "s"


@dataclass(frozen=True, slots=True)
class Channel:
    """One measured or commanded quantity of one car, in SI.

    Attributes:
        t: Times on its table's clock, shape `(n,)` [s]; may jump at a gap or a reset.
        values: Shape `(n,)`, finite.
        std: Standard deviation of the noise; None where the description gives none.
        point: For poses, where on the body the measured point is, from the rear axle [m].
        dimension: What it measures: a steering command may be a ratio or an angle.
        source: The rows of a table that it was read from; None where it is no file's.
    """

    t: Floats
    values: Floats
    std: float | None
    point: tuple[float, float]
    dimension: str
    source: Source | None = None

    def at(self, rows: Bools | Ints) -> "Channel":
        """Return the channel with some of its rows, in this order."""
        source = self.source
        if source is not None and len(source.numbers) == len(self.t):
            source = replace(source, numbers=source.numbers[rows])
        return replace(self, t=self.t[rows], values=self.values[rows], source=source)

    @property
    def row_numbers(self) -> Ints:
        """Number of the row in which each value stands, from 1, shape `(n,)`."""
        if self.source is not None and len(self.source.numbers) == len(self.t):
            return self.source.numbers
        return np.arange(1, len(self.t) + 1)


@dataclass(frozen=True, slots=True)
class Recording:
    """What was recorded of one car.

    Attributes:
        path: Of its description.
        vehicle: Name or path of its car file.
        channels: By name, as in the recordings contract.
        name: Which of the recording's cars it is: as its tables call it, or in a run as the city
            does.
        begin_s: From when a part of it counts: a run of a city begins before its car is driven;
            None: from the first row.
        left_out: What its files hold that is no row: broken lines, the rest of a cut-off file.
        scans: Of its LIDAR, where the description names any.
    """

    path: Path
    vehicle: str
    channels: dict[str, Channel]
    name: str = ""
    begin_s: float | None = None
    left_out: tuple[LeftOut, ...] = ()
    scans: Scans | None = None

    def channel(self, name: str) -> Channel:
        """Return a channel.

        Raises:
            RecordingError: when the recording has none of that name.
        """
        if name not in self.channels:
            msg = f"{self.path}: no channel {name!r}; it has {', '.join(sorted(self.channels))}"
            raise RecordingError(msg)
        return self.channels[name]


def read_recordings(path: Path | str, data: Path | str | None = None) -> list[Recording]:
    """Read a recording of one or several cars.

    Args:
        path: A description file, or a folder holding `recording.yaml`.
        data: Folder that the tables' files are relative to; None: the description's own.

    Returns:
        One `Recording` a vehicle, in the order in which the description names them.

    Raises:
        RecordingError: naming file, table, column, line and reason.
    """
    if not Path(path).is_dir():
        refuse_data(Path(path))
    found = find_description(Path(path))
    description = read_description(found)
    folder = found.parent if data is None else Path(data)
    by_vehicle: dict[str, dict[str, Channel]] = {}
    scans: dict[str, Scans] = {}
    held: dict[str, dict[str, float]] = {}
    names: dict[str, str] = {}
    loaded = _loaded(description.tables, folder, found)
    origin_s = _origin_s(description.tables, loaded)
    left_out: dict[str, dict[LeftOut, None]] = {}  # two tables may share a file
    for index, table in enumerate(description.tables):
        vehicle = _vehicle(description, table, found.parent)
        names[vehicle] = table.vehicle or description.vehicle or ""
        channels = by_vehicle.setdefault(vehicle, {})
        columns = loaded[_rows_of(table)]
        for name, channel in _channels(table, index, columns, found, origin_s).items():
            if name in channels:
                msg = f"{found}: table {table.file}: channel {name!r} of {vehicle} is given twice"
                raise RecordingError(msg)
            channels[name] = channel
            if table.hold_s is not None and name.startswith("command."):
                held.setdefault(vehicle, {})[name] = table.hold_s
        left_out.setdefault(vehicle, {}).update(dict.fromkeys(columns.left_out))
        if SCAN in table.channels:
            if vehicle in scans:
                msg = f"{found}: table {table.file}: {vehicle} has the scans of another table too"
                raise RecordingError(msg)
            t, keep = _selected_rows(table, columns, f"{found}: table {table.file}", origin_s)
            scans[vehicle] = read_scans(folder / table.file, table.topic, t, keep)
    return [
        Recording(
            path=found,
            vehicle=vehicle,
            channels=_held(channels, held.get(vehicle, {})),
            name=names[vehicle],
            left_out=tuple(left_out[vehicle]),
            scans=scans.get(vehicle),
        )
        for vehicle, channels in by_vehicle.items()
    ]


def _held(channels: dict[str, Channel], hold_s: Mapping[str, float]) -> dict[str, Channel]:
    """Return channels with a row at each moment of the poses at which a held command is silent."""
    moments = channels["pose.x"].t if "pose.x" in channels else np.empty(0)
    return {
        name: _in_force(channel, hold_s[name], moments) if name in hold_s else channel
        for name, channel in channels.items()
    }


def _in_force(command: Channel, hold_s: float, moments: Floats) -> Channel:
    """Return a command with rows that say what the car obeys in silence: it, and then nothing.

    Args:
        command: As recorded.
        hold_s: How long the car obeys a command that no other follows [s].
        moments: At which something else is known of the car, (n,) [s].
    """
    order = np.argsort(command.t, kind="stable")
    t = command.t[order]
    ends = (t + hold_s)[t + hold_s < np.append(t[1:], np.inf)]
    moments = np.union1d(moments[moments > t[0]], ends[ends < moments.max(initial=-np.inf)])
    last = order[np.searchsorted(t, moments, side="right") - 1]
    since = moments - command.t[last]
    silent = since > min(SILENCE_S, 0.5 * hold_s)
    moments, last = moments[silent], last[silent]
    obeyed = np.where(since[silent] < hold_s - TINY_S, command.values[last], 0.0)
    return replace(
        command,
        t=np.insert(command.t, last + 1, moments),
        values=np.insert(command.values, last + 1, obeyed),
    )


def _rows_of(table: Table) -> RowsOf:
    """Return what says whose rows a table has: two tables may share a file and a topic."""
    return table.file, table.topic, table.columns, table.definitions


def _loaded(tables: Sequence[Table], folder: Path, path: Path) -> dict[RowsOf, Columns]:
    """Return the columns that the tables ask for; each file, or topic of a bag, is read once."""
    wanted: dict[RowsOf, set[str]] = {}
    for table in tables:
        names = wanted.setdefault(_rows_of(table), set())
        sources: dict[str, TimeColumn | ChannelColumn] = {"time": table.time, **table.channels}
        for name, source in sources.items():
            if source.expression is not None:
                names |= columns_of(source.expression, f"{path}: table {table.file}: {name}")
            else:
                names.add(str(source.column))
        names |= {one.variance for one in table.channels.values() if one.variance is not None}
        if table.where is not None:
            names |= columns_of(table.where, f"{path}: table {table.file}: where")
    return {
        rows: read_table(
            folder / rows[0],
            rows[1],
            names,
            columns=rows[2],
            definitions=None if rows[3] is None else folder / rows[3],
        )
        for rows, names in wanted.items()
    }


def _origin_s(tables: Sequence[Table], loaded: Mapping[RowsOf, Columns]) -> int:
    """Return the instant that all times of the recording are counted from, in whole seconds.

    It is 0 unless a table counts nanoseconds on a clock whose seconds are too many for one float
    to hold its nanoseconds too: then it is the whole second in which the first such table begins.
    """
    for table in tables:
        t_ns = _nanoseconds(table, loaded[_rows_of(table)])
        if t_ns is not None and len(t_ns) and abs(int(t_ns.min())) > LONGEST_FROM_ZERO_S * NS_PER_S:
            return int(t_ns.min()) // NS_PER_S
    return 0


def _nanoseconds(table: Table, columns: Columns) -> Ints | None:
    """Return a table's times to the nanosecond, without its offset, where they are so exact."""
    if table.time.column is None:
        return None
    return columns.nanoseconds(table.time.column, str(table.time.unit))


def _vehicle(description: Description, table: Table, folder: Path) -> str:
    """Return the name of a table's car, or the path of its file: beside the description first."""
    vehicle = table.vehicle or description.vehicle
    if vehicle is None:  # refused when the description was read
        msg = f"table {table.file}: no vehicle"
        raise RecordingError(msg)
    beside = folder / vehicle
    return str(beside) if beside.suffix == ".toml" and beside.is_file() else vehicle


def _channels(
    table: Table, index: int, columns: Columns, path: Path, origin_s: int
) -> dict[str, Channel]:
    """Return the channels of one table in SI, times counted from `origin_s`."""
    where = f"{path}: table {table.file}"
    t, keep = _selected_rows(table, columns, where, origin_s)
    source = Source(
        table=f"{table.file} {table.topic}" if table.topic else table.file,
        index=index,
        rows=columns.rows,
        excluded=columns.rows - int(keep.sum()),
        numbers=np.flatnonzero(keep) + 1,
        time_unit=str(table.time.unit),
    )
    found = {}
    for name, channel in table.channels.items():
        if name == SCAN:
            continue
        at = f"{where}: {name}"
        raw = _values(channel, columns, at)[keep]
        std = channel.std if channel.variance is None else _std(columns, channel.variance, at, keep)
        found[name] = _channel(name, channel, t[keep], raw, std, where, source)
    return found


def _selected_rows(
    table: Table, columns: Columns, where: str, origin_s: int
) -> tuple[Floats, Bools]:
    """Return the time of every row of a table, and which rows its `where` keeps."""
    keep: Bools = np.ones(columns.rows, dtype=np.bool_)
    if table.where is not None:
        keep = evaluate(table.where, columns, columns.rows, f"{where}: where") > 0.0
    t = _times(table, columns, f"{where}: time", origin_s)
    _refuse_no_rows(t[keep], where)
    return t, keep


def _std(columns: Columns, variance: str, at: str, keep: Bools) -> float | None:
    """Return the noise that rows usually give as its variance, or None where they know of none."""
    given = _column(columns, variance, at)[keep]
    known = given[(given > 0.0) & (given < LARGEST_VARIANCE)]
    return float(np.sqrt(np.median(known))) if len(known) else None


def _times(table: Table, columns: Columns, at: str, origin_s: int) -> Floats:
    """Return the time of each row since `origin_s` [s]."""
    to_s = factor(str(table.time.unit), ("time",), at)
    t_ns = _nanoseconds(table, columns)
    if t_ns is not None:
        since: Floats = (t_ns - origin_s * NS_PER_S) / NS_PER_S
        return since + table.time.offset * to_s
    return (_values(table.time, columns, at) + table.time.offset) * to_s - origin_s


def _values(source: TimeColumn | ChannelColumn, columns: Columns, at: str) -> Floats:
    """Return what a column or an expression gives for every row."""
    if source.expression is not None:
        return evaluate(source.expression, columns, columns.rows, at)
    return _column(columns, str(source.column), at)


def _column(columns: Columns, name: str, at: str) -> Floats:
    try:
        return columns[name]
    except RecordingError as cause:
        msg = f"{at}: {cause}"
        raise RecordingError(msg) from cause


def _channel(
    name: str,
    channel: ChannelColumn,
    t: Floats,
    raw: Floats,
    std: float | None,
    where: str,
    source: Source,
) -> Channel:
    at, unit = f"{where}: {name}", str(channel.unit)
    to_si = factor(unit, dimensions_of(name, where), at)
    values = channel.sign * (channel.scale * raw + channel.offset) * to_si
    valid: Bools = np.isfinite(values) & np.isfinite(t)
    _refuse_no_rows(t[valid], at)
    if not valid.all():
        source = replace(source, numbers=source.numbers[valid])
        t, values = t[valid], values[valid]
    return Channel(
        t=t,
        values=values,
        std=None if std is None else std * to_si,
        point=channel.point or (0.0, 0.0),
        dimension=UNITS[unit][0],
        source=source,
    )


def _refuse_no_rows(t: Floats, where: str) -> None:
    if len(t) == 0:
        msg = f"{where}: no row is left"
        raise RecordingError(msg)
