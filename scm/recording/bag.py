"""ROS bags as columns: one topic's messages are the rows, their fields the columns.

`pose.position.x` is a field, `axes[1]` an element of an array. Every time in a message counts as
seconds; `received_s` is when a message was recorded, `stamp_s` the time in its header.
"""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from scm.arrays import Floats, Ints
from scm.errors import RecordingError, nearest
from scm.recording.columns import NS_PER_S, Columns, Selection, refuse_large

RECEIVED, STAMP, STAMP_FIELD = "received_s", "stamp_s", "header.stamp"
OTHER_PROFILE = "Profile is not ros2"
ELEMENTS_NAMED = 9
_FIELD = re.compile(r"[A-Za-z]\w*(\[\d+\])*(\.[A-Za-z]\w*(\[\d+\])*)*")
_PART = re.compile(r"\w+")


class _Instant(int):
    """A time in a message [ns]."""


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted fields of one topic's messages.

    Raises:
        RecordingError: when there is no such topic, or its messages are none, or too many.
    """
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        with reader:
            return _topic(reader, _chosen(reader, selection.topic, path), path, selection.wanted)
    except RecordingError:
        raise
    except Exception as cause:
        if OTHER_PROFILE not in str(cause):
            raise
        msg = f"{path}: no ROS 2 recording; a run of this city is read as it is: scm replay {path}"
        raise RecordingError(msg) from cause


def _chosen(reader: AnyReader, topic: str | None, path: Path) -> str:
    """Return the topic, if the bag has it."""
    known = sorted({connection.topic for connection in reader.connections})
    if topic is None:
        msg = f"{path}: a ROS bag: its table needs a topic, one of {', '.join(known)}"
        raise RecordingError(msg)
    if topic not in known:
        hint = nearest(topic, known) or f"; it has {', '.join(known)}"
        msg = f"{path}: no topic {topic!r}{hint}"
        raise RecordingError(msg)
    return topic


def _topic(reader: AnyReader, topic: str, path: Path, wanted: Collection[str] | None) -> Columns:
    """Return the columns of one topic."""
    connections = [one for one in reader.connections if one.topic == topic]
    received: list[int] = []
    known: list[str] = []
    picked: dict[str, list[Any]] = {}
    size = 0
    for connection, t_ns, raw in reader.messages(connections=connections):
        size += len(raw)
        refuse_large(size, path, f"topic {topic!r} ")
        message = reader.deserialize(raw, connection.msgtype)
        if not received:
            known = [RECEIVED, *_names(message)]
            picked = {name: [] for name in (known if wanted is None else wanted)}
        received.append(t_ns)
        for name, values in picked.items():
            values.append(_pick(message, name))
    if not received:
        msg = f"{path}: topic {topic!r} holds no messages"
        raise RecordingError(msg)
    return _as_columns(path, topic, received, picked, known)


def _as_columns(
    path: Path, topic: str, received: list[int], picked: dict[str, list[Any]], known: list[str]
) -> Columns:
    """Return what was picked of each message as columns; what no message has is left out."""
    picked = {**picked, RECEIVED: [_Instant(t) for t in received]}
    cells: dict[str, Sequence[str] | Floats] = {}
    ticks: dict[str, tuple[Ints, int]] = {}
    for name, values in picked.items():
        there = [value for value in values if value is not None]
        if not there:
            continue
        if name == STAMP and not any(there):
            msg = f"{path}: topic {topic!r}: {STAMP} is 0 in every message: use {RECEIVED}"
            raise RecordingError(msg)
        if isinstance(there[0], str):
            cells[name] = [value or "" for value in values]
            continue
        per_value = NS_PER_S if isinstance(there[0], _Instant) else 1
        numbers = np.array([np.nan if value is None else value for value in values], np.float64)
        cells[name] = numbers / per_value
        if len(there) == len(values) and all(_is_whole(value) for value in there):
            ticks[name] = np.array(there, np.int64), per_value
    lines = range(1, len(received) + 1)
    return Columns(path, list(cells), list(cells.values()), lines, known=known, ticks=ticks)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 63


def _pick(message: Any, name: str) -> float | str | None:
    """Return a field of a message; None where it has none of that name, or no single value."""
    if not _FIELD.fullmatch(STAMP_FIELD if name == STAMP else name):
        return None
    value = message
    for part in _PART.findall(STAMP_FIELD if name == STAMP else name):
        if part.isdigit():
            if not isinstance(value, list | np.ndarray) or int(part) >= len(value):
                return None
            value = value[int(part)]
        elif is_dataclass(value) and part in _fields(value):
            value = getattr(value, part)
        else:
            return None
    return _single(value)


def _single(value: Any) -> float | str | None:
    """Return a number, a word or a time as it is, anything larger as None."""
    if isinstance(value, np.generic):
        value = value.item()
    if is_dataclass(value) and _fields(value) == ["sec", "nanosec"]:
        sec, nanosec = (getattr(value, name) for name in _fields(value))
        return _Instant(sec * NS_PER_S + nanosec)
    return value if isinstance(value, int | float | str) else None


def _fields(value: Any) -> list[str]:
    return [field.name for field in fields(value) if not field.name.startswith("__")]


def _names(message: Any) -> list[str]:
    """Return what the fields of a message are called; of long arrays the first elements."""
    names = [path for path, value in _leaves(message, "") if _single(value) is not None]
    return [STAMP, *names] if STAMP_FIELD in names else names


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield every value of a message that has no parts, with its path."""
    if is_dataclass(value) and _single(value) is None:
        for name in _fields(value):
            yield from _leaves(getattr(value, name), f"{path}.{name}" if path else name)
    elif isinstance(value, list | np.ndarray):
        for k in range(min(len(value), ELEMENTS_NAMED)):
            yield from _leaves(value[k], f"{path}[{k}]")
    else:
        yield path, value
