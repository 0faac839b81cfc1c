"""ROS bags as columns: one topic's messages are the rows, their fields the columns.

`pose.position.x` is a field, `axes[1]` an element of an array. All times in a message are in
seconds; `received_s` is the time of recording, `stamp_s` the time in the message's header.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import RecordingError, nearest
from scm.recording.bag_file import BagFile, Raw, open_bag
from scm.recording.bag_types import Deserialize, deserializer
from scm.recording.columns import (
    MAX_BAD_CELLS,
    NS_PER_S,
    Columns,
    LeftOut,
    Selection,
    refuse_large,
)

RECEIVED, STAMP, STAMP_FIELD = "received_s", "stamp_s", "header.stamp"
ELEMENTS_NAMED = 9
_FIELD = re.compile(r"[A-Za-z]\w*(\[\d+\])*(\.[A-Za-z]\w*(\[\d+\])*)*")
_PART = re.compile(r"\w+")


class _Instant(int):
    """A time in a message [ns]."""


def read(path: Path, selection: Selection) -> Columns:
    """Return the wanted fields of one topic's messages.

    Raises:
        RecordingError: when there is no such topic, or its messages are none, or too many, or of
            a type that nobody defines.
    """
    topic = _Topic(path, selection)
    received: list[int] = []
    lines: list[int] = []
    known: list[str] = []
    picked: dict[str, list[Any]] = {}
    for number, raw, message in topic.messages():
        if not received:
            known = [RECEIVED, *_names(message)]
            picked = {
                name: [] for name in (known if selection.wanted is None else selection.wanted)
            }
        received.append(raw[1])
        lines.append(number)
        for name, values in picked.items():
            values.append(_pick(message, name))
    return _as_columns(topic, received, picked, known, lines)


def messages(path: Path, topic: str | None) -> Iterator[tuple[str, int, Any]]:
    """Yield the type, the time of arrival [ns] and the content of each row's message.

    Raises:
        RecordingError: as `read` does.
    """
    for _, (of, t_ns, _), message in _Topic(path, Selection(topic)).messages():
        yield of.kind, t_ns, message


def _chosen(bag: BagFile, topic: str | None, path: Path) -> str:
    """Return the topic, if the bag has it."""
    known = sorted({one.name for one in bag.topics})
    if topic is None:
        msg = f"{path}: a ROS bag: its table needs a topic, one of {', '.join(known)}"
        raise RecordingError(msg)
    if topic not in known:
        hint = nearest(topic, known) or f"; it has {', '.join(known)}"
        msg = f"{path}: no topic {topic!r}{hint}"
        raise RecordingError(msg)
    return topic


class _Topic:
    """The messages of one topic, in the order in which they were recorded."""

    def __init__(self, path: Path, selection: Selection) -> None:
        self.path, self._definitions = path, selection.definitions
        self._deserialize: dict[str, Deserialize] = {}
        self._raws: list[Raw] = []
        with ExitStack() as stack:
            bag = open_bag(path, stack)
            self.name = _chosen(bag, selection.topic, path)
            size = 0
            for raw in bag.messages(self.name):
                size += len(raw[2])
                refuse_large(size, path, f"topic {self.name!r} ")
                self._raws.append(raw)
            self.left_out = bag.left_out
        if not self._raws:
            msg = f"{path}: topic {self.name!r} holds no messages"
            raise RecordingError(msg)
        self._raws.sort(key=lambda raw: raw[1])

    def messages(self) -> Iterator[tuple[int, Raw, Any]]:
        """Yield messages with their numbers from 1; the few that cannot be read are left out."""
        bad: list[LeftOut] = []
        for number, raw in enumerate(self._raws, start=1):
            try:
                message = self._message(raw)
            except RecordingError:
                raise
            except Exception as cause:
                why = f"{self.name}: no {raw[0].kind}: {' '.join(str(cause).split())}"
                bad.append(LeftOut(self.path.name, number, why))
                if len(bad) > MAX_BAD_CELLS * len(self._raws):
                    msg = (
                        f"{self.path}: message {bad[0].line} of {bad[0].why}; is its definition "
                        "of another version? `definitions:` gives the right one"
                    )
                    raise RecordingError(msg) from cause
                continue
            yield number, raw, message
        self.left_out += bad

    def _message(self, raw: Raw) -> Any:
        topic, _, data = raw
        if topic.kind not in self._deserialize:
            self._deserialize[topic.kind] = deserializer(topic, self._definitions, self.path)
        return self._deserialize[topic.kind](data)


def _as_columns(
    topic: _Topic,
    received: list[int],
    picked: dict[str, list[Any]],
    known: list[str],
    lines: Sequence[int],
) -> Columns:
    """Return what was picked of each message as columns; what no message has is left out."""
    path = topic.path
    picked = {**picked, RECEIVED: [_Instant(t) for t in received]}
    cells: dict[str, Sequence[str] | Floats] = {}
    ticks: dict[str, tuple[Ints, int]] = {}
    for name, values in picked.items():
        there = [value for value in values if value is not None]
        if not there:
            continue
        if name == STAMP and not any(there):
            msg = f"{path}: topic {topic.name!r}: {STAMP} is 0 in every message: use {RECEIVED}"
            raise RecordingError(msg)
        if isinstance(there[0], str):
            cells[name] = [value or "" for value in values]
            continue
        per_value = NS_PER_S if isinstance(there[0], _Instant) else 1
        numbers = np.array([np.nan if value is None else value for value in values], np.float64)
        cells[name] = numbers / per_value
        if len(there) == len(values) and all(_is_whole(value) for value in there):
            ticks[name] = np.array(there, np.int64), per_value
    names, left_out = list(cells), topic.left_out
    return Columns(
        path, names, list(cells.values()), lines, known=known, ticks=ticks, left_out=left_out
    )


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 63


def _pick(message: Any, name: str) -> float | str | None:
    """Return a field of a message; None where it has none of that name, or no single value."""
    value = message
    for part in _path(name):
        if part.isdigit():
            if not isinstance(value, list | np.ndarray) or int(part) >= len(value):
                return None
            value = value[int(part)]
        elif is_dataclass(value) and part in _fields(value):
            value = getattr(value, part)
        else:
            return None
    return _single(value) if _path(name) else None


@lru_cache
def _path(name: str) -> tuple[str, ...]:
    """Return the parts of a field's name, none where it names no field."""
    field = STAMP_FIELD if name == STAMP else name
    return tuple(_PART.findall(field)) if _FIELD.fullmatch(field) else ()


def _single(value: Any) -> float | str | None:
    """Return a number, a word or a time as it is, anything larger as None."""
    if isinstance(value, np.generic):
        value = value.item()
    if is_dataclass(value) and _fields(value) == ("sec", "nanosec"):
        sec, nanosec = (getattr(value, name) for name in ("sec", "nanosec"))
        return _Instant(sec * NS_PER_S + nanosec)
    return value if isinstance(value, int | float | str) else None


def _fields(value: Any) -> tuple[str, ...]:
    kind: Any = type(value)
    return _fields_of(kind)


@lru_cache
def _fields_of(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind) if not field.name.startswith("__"))


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
