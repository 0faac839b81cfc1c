"""Repairs a recording whose writer was killed: copies every intact message to an indexed file."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import IO, cast

from mcap.records import Channel, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from scm.errors import RecordingError
from scm.recorder.mcap_file import UNREADABLE, Begin


@dataclass(frozen=True, slots=True)
class Recovered:
    """The result of a recovery.

    Attributes:
        messages: How many were copied.
        span_s: From the first to the last of them [s].
        whole: Whether the file was complete already.
        grew: Whether it was still written: only what it had at the start is copied.
    """

    path: Path
    messages: int
    span_s: float
    whole: bool
    grew: bool = False


def recover(broken: Path, repaired: Path | None = None) -> Recovered:
    """Copy what can be read of a truncated recording.

    Args:
        broken: The recording; it is not changed.
        repaired: Where to write; None: beside it, as `<name>.recovered.mcap`.

    Raises:
        RecordingError: when nothing can be read, or the target is the source.
    """
    target = repaired or broken.with_suffix(".recovered.mcap")
    if target.resolve() == broken.resolve():
        msg = f"{broken}: cannot be recovered onto itself"
        raise RecordingError(msg)
    try:
        stream = broken.open("rb")
    except OSError as cause:
        msg = f"{broken}: cannot be read: {cause.strerror}"
        raise RecordingError(msg) from cause
    with stream:
        try:
            copy = _Copy(target)
        except OSError as cause:
            msg = f"{target}: cannot be written: {cause.strerror}"
            raise RecordingError(msg) from cause
        try:
            size = os.fstat(stream.fileno()).st_size
            whole = _copy_all(stream, size, copy)
            grew = os.fstat(stream.fileno()).st_size > size
        finally:
            copy.close()
    if copy.messages == 0:
        target.unlink()
        msg = f"{broken}: holds no whole message"
        raise RecordingError(msg)
    return Recovered(target, copy.messages, (copy.last_ns - copy.first_ns) * 1e-9, whole, grew)


def _copy_all(stream: IO[bytes], size: int, copy: "_Copy") -> bool:
    """Copy up to `size` or the first invalid record; return whether the end record was found."""
    try:
        for record in StreamReader(cast("IO[bytes]", Begin(stream, size))).records:
            copy.add(record)
    except UNREADABLE:
        return False
    return True


class _Copy:
    """Writes records into a new file, with ids of its own."""

    def __init__(self, path: Path) -> None:
        self._stream = path.open("wb")
        self._writer = Writer(self._stream)
        self._writer.start(profile="scm", library="scm recover")
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        self.messages = 0
        self.first_ns = self.last_ns = 0

    def add(self, record: McapRecord) -> None:
        """Copy a schema, channel, message or metadata record; others belong to the old index."""
        match record:
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(
                    record.name, record.encoding, record.data
                )
            case Channel() if record.id not in self._channels:
                self._channels[record.id] = self._writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas.get(record.schema_id, 0),
                )
            case Message():
                self._message(record)
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)

    def _message(self, record: Message) -> None:
        self._writer.add_message(
            channel_id=self._channels[record.channel_id],
            log_time=record.log_time,
            publish_time=record.publish_time,
            sequence=record.sequence,
            data=record.data,
        )
        self.first_ns = record.log_time if self.messages == 0 else self.first_ns
        self.last_ns = max(self.last_ns, record.log_time)
        self.messages += 1

    def close(self) -> None:
        """Complete the new file with its index."""
        self._writer.finish()
        self._stream.close()
