"""A run as an MCAP file: one channel a key, JSON messages, one schema a message class.

The raw key is the channel's topic, so that a replay can publish again. A bulk message becomes JSON
too, its payload in base64, so that any MCAP tool can read the whole file; so do bytes that are not
JSON though they should be.
"""

import struct
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import Writer

from scm import __version__
from scm.errors import RecordingError
from scm.registry import load, names
from scm.v2x.exchange import RawSample
from scm.v2x.key import matches, prefix, variables
from scm.v2x.message import Message, Request

MESSAGES = "scm.v2x.messages"
UNREADABLE = (  # what a torn or damaged file makes its readers raise
    McapError, EOFError, ValueError, LookupError, MemoryError, OverflowError, struct.error,
    zstandard.ZstdError,
)  # fmt: skip


class RunFile:
    """Writes one run; a context manager that always ends the file properly.

    Raises:
        RecordingError: when the file is there already, or cannot be written (any more).
    """

    def __init__(self, path: Path, city: str) -> None:
        self.path = path
        self.messages = 0
        if path.exists():
            msg = f"{path}: is there already: a recording is never written over"
            raise RecordingError(msg)
        with _writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("xb")
        self._writer = Writer(self._stream)
        self._schemas = SchemaTable(city)
        self._schema_ids: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        with _writing(path):
            self._writer.start(profile="scm", library=f"scm {__version__}")
            self._writer.add_metadata("scm", {"version": __version__, "city": city})
            self._writer.flush()

    def write(self, sample: RawSample) -> None:
        """Add one message as it came from the bus."""
        with _writing(self.path):
            self._writer.add_message(
                channel_id=self._channel(sample.key),
                log_time=sample.t_ns,
                publish_time=sample.t_ns,
                sequence=self.messages & 0xFFFFFFFF,
                data=_as_json(sample.body, sample.attachment),
            )
        self.messages += 1

    def kind_of(self, key: str) -> type[Message] | None:
        """Return the message class that travels on a key; None for a foreign key."""
        return self._schemas.kind_of(key)

    def flush(self) -> None:
        """Hand everything written so far to the operating system: a kill can no longer lose it."""
        with _writing(self.path):
            self._writer.flush()

    def close(self) -> None:
        """End the file with its index; safe to call twice."""
        if not self._stream.closed:
            with _writing(self.path), self._stream:
                self._writer.finish()

    def discard(self) -> None:
        """End the file; when it holds no message, take it away as if it had never been there."""
        self.close()
        if self.messages == 0:
            self.path.unlink()

    def __enter__(self) -> "RunFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _channel(self, key: str) -> int:
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(
                topic=key, message_encoding="json", schema_id=self._schema(key)
            )
        return self._channels[key]

    def _schema(self, key: str) -> int:
        """Return the schema of the message class a key belongs to; 0 (none) for a foreign key."""
        kind = self._schemas.kind_of(key)
        if kind is None:
            return 0
        name = f"scm.{kind.__name__}"
        if name not in self._schema_ids:
            data = msgspec.json.encode(msgspec.json.schema(kind))
            self._schema_ids[name] = self._writer.register_schema(name, "jsonschema", data)
        return self._schema_ids[name]


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as cause:
        msg = f"{path}: cannot be written: {cause.strerror or cause}"
        raise RecordingError(msg) from cause


class SchemaTable:
    """Which message class travels on which key."""

    def __init__(self, city: str) -> None:
        kinds = [load(MESSAGES, name, "MESSAGE", type) for name in names(MESSAGES)]
        self._expressions = [
            (prefix(city) + kind.KEY.format(**dict.fromkeys(variables(kind), "*")), kind)
            for kind in kinds
            if issubclass(kind, Message) and not issubclass(kind, Request)
        ]
        self._found: dict[str, type[Message] | None] = {}

    def kind_of(self, key: str) -> type[Message] | None:
        """Return the message class of a concrete key, None for a key that is nobody's."""
        if key not in self._found:
            kinds = (kind for expression, kind in self._expressions if matches(expression, key))
            self._found[key] = next(kinds, None)
        return self._found[key]


def _as_json(body: bytes, attachment: bytes | None) -> bytes:
    """Return a message as JSON: as it came, or as an object that holds its bytes in base64."""
    try:
        if attachment is None:
            msgspec.json.decode(body, type=msgspec.Raw)
            return body
        fields = msgspec.json.decode(attachment, type=dict[str, Any])
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        if attachment is None:
            return msgspec.json.encode({"unreadable": body})
        fields = {"unreadable": attachment}
    fields["payload"] = body
    return msgspec.json.encode(fields)


class Recorded(NamedTuple):
    """One message of a run: when it was heard [ns], its key, and its JSON."""

    t_ns: int
    key: str
    body: bytes


def read_run(path: Path, keys: Collection[str] | None = None) -> Iterator[Recorded]:
    """Yield the messages of a complete run in the order of their times; of some keys or of all.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    with _reading(path), path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(topics=keys):
            yield Recorded(message.log_time, channel.topic, message.data)


def read_keys(path: Path) -> list[str]:
    """Return the keys on which something was heard in a complete run, sorted.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    with _reading(path), path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        return sorted({channel.topic for channel in summary.channels.values()}) if summary else []


def read_begin_ns(path: Path) -> int | None:
    """Return when the first message of a complete run was heard; None: it holds none.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    with _reading(path), path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        chunks = summary.chunk_indexes if summary else []
        return min((chunk.message_start_time for chunk in chunks), default=None)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as cause:
        msg = f"{path}: cannot be read: {cause.strerror or cause}"
        raise RecordingError(msg) from cause
    except UNREADABLE as cause:
        why = str(cause) or "it ends too soon"
        msg = f"{path}: not a complete recording ({why}): try `scm recover {path}`"
        raise RecordingError(msg) from cause
