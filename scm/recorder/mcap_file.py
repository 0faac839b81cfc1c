"""A run as an MCAP file: one channel per key, JSON messages, one schema per message class.

The channel's topic is the raw key, so a replay can publish it again. Bulk messages, and invalid
ones, are stored as JSON with their bytes in base64, so any MCAP tool can read the whole file.
"""

import os
import struct
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any, NamedTuple, cast

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from scm import __version__
from scm.errors import MAX_REASON, RecordingError
from scm.v2x.exchange import RawSample
from scm.v2x.key import matches, prefix, variables
from scm.v2x.message import Message, Request
from scm.v2x.messages import message_classes

MESSAGES = "scm.v2x.messages"
MAGIC = b"\x89MCAP0\r\n"
MAX_UNPACKED_BYTES = 256 * 2**20  # of one chunk; a larger one is damaged or malicious
UNREADABLE = (  # raised by readers of a truncated or damaged file
    McapError, EOFError, ValueError, LookupError, MemoryError, OverflowError, struct.error,
    zstandard.ZstdError,
)  # fmt: skip


class RunFile:
    """Writes one run; a context manager that always ends the file properly.

    Raises:
        RecordingError: when the file exists, or can no longer be written.
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
        """Add one message as received from the bus."""
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
        """Return the message class of a key; None for an unknown key."""
        return self._schemas.kind_of(key)

    def flush(self) -> None:
        """Pass everything written so far to the operating system, so a kill cannot lose it."""
        with _writing(self.path):
            self._writer.flush()

    def close(self) -> None:
        """Complete the file with its index; safe to call twice."""
        if not self._stream.closed:
            with _writing(self.path), self._stream:
                self._writer.finish()

    def discard(self) -> None:
        """Complete the file; delete it if it has no message."""
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
        """Return the schema of a key's message class; 0 (none) for an unknown key."""
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
    """Finds the message class of a key."""

    def __init__(self, city: str) -> None:
        self._expressions = [
            (prefix(city) + kind.KEY.format(**dict.fromkeys(variables(kind), "*")), kind)
            for kind in message_classes()
            if not issubclass(kind, Request)
        ]
        self._found: dict[str, type[Message] | None] = {}

    def kind_of(self, key: str) -> type[Message] | None:
        """Return the message class of a concrete key; None for an unknown key."""
        if key not in self._found:
            kinds = (kind for expression, kind in self._expressions if matches(expression, key))
            self._found[key] = next(kinds, None)
        return self._found[key]


def _as_json(body: bytes, attachment: bytes | None) -> bytes:
    """Return a message as JSON: as received, or as an object with its bytes in base64."""
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
    """One message of a run: time received [ns], key, and JSON."""

    t_ns: int
    key: str
    body: bytes


class Begin:
    """The first bytes of a file that may grow: reading to its end might never finish."""

    def __init__(self, stream: IO[bytes], size: int) -> None:
        self._stream, self._left = stream, size

    def read(self, length: int) -> bytes:
        """Return so many bytes, or as many as are left."""
        data = self._stream.read(min(length, self._left))
        self._left -= len(data)
        return data


def has_end(path: Path) -> bool:
    """Return whether the recorder completed the file; if not, it is still writing or was killed.

    Raises:
        RecordingError: when it is not an MCAP file or cannot be read.
    """
    with _reading(path), path.open("rb") as stream:
        begin = stream.read(len(MAGIC))
        if begin != MAGIC:
            msg = f"{path}: no run of a city: an MCAP file begins otherwise"
            raise RecordingError(msg)
    return _ends(path)


def _ends(path: Path) -> bool:
    with path.open("rb") as stream:
        stream.seek(max(len(MAGIC), stream.seek(0, 2) - len(MAGIC)))
        return stream.read() == MAGIC


def read_run(
    path: Path, keys: Collection[str] | None = None, *, whole: bool = True
) -> Iterator[Recorded]:
    """Yield the messages of a run in order of time.

    Args:
        path: The `.mcap`.
        keys: Keys to read; None: all.
        whole: Refuse an incomplete file; otherwise read as much as is intact.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    if not whole and not has_end(path):
        yield from _begun(path, keys)
        return
    with _reading(path), path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(topics=keys):
            yield Recorded(message.log_time, channel.topic, message.data)


def _begun(path: Path, keys: Collection[str] | None) -> Iterator[Recorded]:
    """Yield the intact messages of an incomplete file."""
    topics: dict[int, str] = {}
    with _reading(path), path.open("rb") as stream:
        begin = Begin(stream, os.fstat(stream.fileno()).st_size)
        reader = StreamReader(cast("IO[bytes]", begin), record_size_limit=MAX_UNPACKED_BYTES)
        with suppress(*UNREADABLE):
            for record in reader.records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, McapMessage):
                    key = topics[record.channel_id]
                    if keys is None or key in keys:
                        yield Recorded(record.log_time, key, record.data)


def read_keys(path: Path, *, whole: bool = True) -> list[str]:
    """Return the keys with messages in a run, sorted.

    Args:
        path: The `.mcap`.
        whole: As for `read_run`.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    if not whole and not has_end(path):
        return sorted({one.key for one in _begun(path, None)})
    with _reading(path), path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        return sorted({channel.topic for channel in summary.channels.values()}) if summary else []


def read_begin_ns(path: Path, *, whole: bool = True) -> int | None:
    """Return the time of the first message of a run; None if there is none.

    Args:
        path: The `.mcap`.
        whole: As for `read_run`.

    Raises:
        RecordingError: when the file is not a complete MCAP file.
    """
    if not whole and not has_end(path):
        return next((one.t_ns for one in _begun(path, None)), None)
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
        if isinstance(cause, RecordingError):
            raise
        if not _ends(path):
            why = "it has no end: it is still being written, or its recorder was killed"
        else:
            why = " ".join(str(cause).split())[:MAX_REASON] or "it ends too soon"
        msg = f"{path}: not a complete recording ({why}): try `scm recover {path}`"
        raise RecordingError(msg) from cause
