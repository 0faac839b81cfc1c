"""The file `recording.yaml` as data, validated when read."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import msgspec

from scm.errors import RecordingError
from scm.recording.shortcuts import written_out
from scm.yaml_file import read_yaml

FILE_NAME = "recording.yaml"
MAX_PROBLEMS = 20  # in one message: a screen of a terminal


class TimeColumn(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The time of a row, on that table's own clock: a column, or an `expression` over columns.

    Attributes:
        unit: Of the value, and of `offset`.
        offset: Added, where it is known by how much this clock differs from the others.
    """

    column: str | None = None
    expression: str | None = None
    unit: str | int = "s"
    offset: float = 0.0


class ChannelColumn(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """Where a channel's values stand.

    Attributes:
        column: Its column; or `expression` over columns, names with spaces in backquotes.
        unit: Of the value, and of `offset` and `std`; `1` without quotes is a number to YAML.
        std: Standard deviation of the value's noise; None: to be estimated.
        variance: Column of the noise's variance, where rows give it, instead of `std`.
        scale, offset, sign: `value = sign * (scale * raw + offset)`, before the unit is converted.
        point: For poses: where on the body the point is, from the rear axle's centre [m].
    """

    column: str | None = None
    expression: str | None = None
    unit: str | int = "1"
    std: float | None = None
    variance: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    sign: Literal[1, -1] = 1
    point: tuple[float, float] | None = None


class Table(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """One file of rows with one clock.

    Attributes:
        file: Relative to the description, or to the folder given when reading.
        topic: Whose messages are the rows, where the file is a ROS bag.
        columns: Names of the columns by position, where the file names none; null: of a column
            that is not needed.
        definitions: Folder of `.msg` files, where a ROS 2 bag does not define its messages;
            relative as `file` is.
        where: Keep only rows for which this expression over columns is true.
        hold_s: How long the car obeys a command that no other follows; from then on it is 0.
            None: after the last command nothing is known.
    """

    file: str
    time: TimeColumn
    channels: dict[str, ChannelColumn]
    topic: str | None = None
    columns: tuple[str | None, ...] | None = None
    definitions: str | None = None
    where: str | None = None
    vehicle: str | None = None
    hold_s: float | None = None


class Description(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A recording: which car, and where its channels stand.

    Attributes:
        vehicle: Name or path of the car file; each table may name its own.
        frame: What the poses are given in; `world` is a right-handed floor frame.
    """

    recording: Literal[1]
    tables: tuple[Table, ...]
    vehicle: str | None = None
    frame: str = "world"
    source: str = ""
    note: str = ""


def find_description(path: Path) -> Path:
    """Return the description file for a path: itself, or `recording.yaml` in that folder.

    Raises:
        RecordingError: when there is none.
    """
    found = path / FILE_NAME if path.is_dir() else path
    if not found.is_file():
        msg = f"{path}: no recording here: expected a .yaml file or a folder holding {FILE_NAME}"
        raise RecordingError(msg)
    return found


def read_description(path: Path) -> Description:
    """Read and check a description.

    Raises:
        RecordingError: naming the file, the key, what was expected and what was got.
    """
    raw = read_yaml(path)
    if isinstance(raw, dict) and isinstance(raw.get("tables"), list):
        raw = {**raw, "tables": [written_out(table, path) for table in raw["tables"]]}
    try:
        description = msgspec.convert(raw, Description)
    except msgspec.ValidationError as cause:
        msg = f"{path}: {_guilty_channel(raw)}{cause}"
        raise RecordingError(msg) from cause
    problems = _problems(description)
    if problems:
        more = len(problems) - MAX_PROBLEMS
        problems = problems[:MAX_PROBLEMS] + ([f"and {more} problems more"] if more > 0 else [])
        raise RecordingError("\n".join(f"{path}: {problem}" for problem in problems))
    return description


def _guilty_channel(raw: Any) -> str:
    """Return "table: channel: " of the first channel that is malformed, or nothing."""
    try:
        pairs = [(t["file"], *item) for t in raw["tables"] for item in t["channels"].items()]
    except (TypeError, KeyError, AttributeError):
        return ""
    for file, name, channel in pairs:
        try:
            msgspec.convert(channel, ChannelColumn)
        except msgspec.ValidationError:
            return f"table {file}: {name}: "
    return ""


def _problems(description: Description) -> list[str]:
    """Return what is wrong between the keys of a description, in words."""
    problems = [] if description.tables else ["tables: expected at least one, got none"]
    for table in description.tables:
        where = f"table {table.file}"
        if description.vehicle is None and table.vehicle is None:
            problems.append(f"{where}: no vehicle, neither here nor at the top")
        if not table.channels:
            problems.append(f"{where}: no channels")
        problems += _columns_problems(where, table.columns)
        problems += _hold_problems(where, table)
        problems += _time_problems(where, table.time)
        problems += _channel_problems(where, table.channels)
    return problems


def _columns_problems(where: str, columns: Sequence[str | None] | None) -> list[str]:
    if columns is None:
        return []
    if not any(columns):
        return [f"{where}: columns: expected at least one name, got none"]
    counts = Counter(name for name in columns if name is not None)
    return [f"{where}: columns: {name!r} stands twice" for name, n in counts.items() if n > 1]


def _time_problems(where: str, time: TimeColumn) -> list[str]:
    problems = []
    if (time.column is None) == (time.expression is None):
        problems.append(f"{where}: time: expected either column or expression")
    if not math.isfinite(time.offset):
        problems.append(f"{where}: time: offset: expected a finite number, got {time.offset}")
    return problems


def _hold_problems(where: str, table: Table) -> list[str]:
    if table.hold_s is None:
        return []
    if not table.hold_s > 0.0:
        return [f"{where}: hold_s: expected more than 0, got {table.hold_s}"]
    commanded = any(name.startswith("command.") for name in table.channels)
    return [] if commanded else [f"{where}: hold_s: the table has no command to hold"]


def _channel_problems(where: str, channels: Mapping[str, ChannelColumn]) -> list[str]:
    problems = []
    for name, channel in channels.items():
        if (channel.column is None) == (channel.expression is None):
            problems.append(f"{where}: {name}: expected either column or expression")
        if channel.std is not None and not 0.0 < channel.std < math.inf:
            problems.append(f"{where}: {name}: std: expected more than 0, got {channel.std}")
        numbers = {"scale": channel.scale, "offset": channel.offset}
        numbers |= {f"point[{i}]": value for i, value in enumerate(channel.point or ())}
        problems += [
            f"{where}: {name}: {key}: expected a finite number, got {value}"
            for key, value in numbers.items()
            if not math.isfinite(value)
        ]
        if channel.scale == 0.0:
            problems.append(f"{where}: {name}: scale: 0 would lose the values")
    return problems
