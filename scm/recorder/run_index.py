"""Index of a run's file by quarter of a second, so that a seek reads no more than it shows.

A complete file has an index. One that is still being written, or whose writer was killed, is
scanned record by record without decompressing, and only from where the last scan ended.
"""

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.reader import make_reader
from mcap.records import ChunkIndex

from scm.errors import RecordingError
from scm.recorder.mcap_file import MAGIC, MAX_UNPACKED_BYTES, UNREADABLE, Recorded

CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, DATA_END = 0x04, 0x05, 0x06, 0x07, 0x0F
_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_MESSAGE = struct.Struct("<BQHIQQ")  # after its record's header
_LIST, _ENTRY = struct.Struct("<HI"), struct.Struct("<QQ")
_U16, _U32 = struct.Struct("<H"), struct.Struct("<I")


class Chunk(NamedTuple):
    """A piece of a run: its time span [ns], its place in the file, and its channels.

    Attributes:
        start: Of its content in the file, after the record's header.
        length: Of that content [bytes].
        channels: Where in the file the message index of each channel begins, likewise.
    """

    begin_ns: int
    end_ns: int
    start: int
    length: int
    channels: Mapping[int, int]


@dataclass(frozen=True, slots=True)
class RunIndex:
    """The contents of a run's file by position.

    Attributes:
        size: Of the file when it was scanned.
        whole: Whether the file is complete; if not, its writer is running or was killed.
        topics: The bus key of each channel.
        read_to: End of the last complete record [bytes].
        begin_ns, end_ns: Times of the first and last message; 0 in an empty run.
    """

    path: Path
    size: int
    whole: bool
    chunks: tuple[Chunk, ...] = ()
    topics: Mapping[int, str] = field(default_factory=dict)
    read_to: int = 0
    begin_ns: int = field(init=False)
    end_ns: int = field(init=False)

    def __post_init__(self) -> None:
        """Compute begin and end once: every row of a table needs them."""
        begin_ns = min((chunk.begin_ns for chunk in self.chunks), default=0)
        end_ns = max((chunk.end_ns for chunk in self.chunks), default=0)
        object.__setattr__(self, "begin_ns", begin_ns)
        object.__setattr__(self, "end_ns", end_ns)

    @property
    def city(self) -> str:
        """Name of the recorded city, from `scm/@v1/<city>/...`; empty in an empty run."""
        found = (key.split("/") for key in self.topics.values())
        return next((chunks[2] for chunks in found if len(chunks) > 3), "")

    def read(
        self,
        begin_ns: int,
        end_ns: int,
        wanted: Callable[[str], bool],
        damage: list[str] | None = None,
    ) -> Iterator[Recorded]:
        """Yield messages of some keys between two times, chunk by chunk.

        A damaged chunk is left out and reported in `damage`.

        Raises:
            RecordingError: when the file can no longer be opened.
        """
        for chunk, keys, stream in self._holding(begin_ns, end_ns, wanted, self.chunks):
            try:
                places = _places(stream, self.path, chunk, keys, begin_ns, end_ns)
                found = _messages(stream, self.path, chunk, keys, places)
            except RecordingError as error:
                if damage is not None:
                    damage.append(str(error))
                continue
            yield from found

    def newest(self, before_ns: int, wanted: Callable[[str], bool]) -> Recorded | None:
        """Return the last message of some keys up to a time; None if there is none.

        Raises:
            RecordingError: when the file can no longer be opened.
        """
        backwards = self._holding(0, before_ns, wanted, reversed(self.chunks))
        for chunk, keys, stream in backwards:
            try:
                places = _places(stream, self.path, chunk, keys, 0, before_ns)
                last = sorted(places, key=_log_ns)[-1:]
                found = _messages(stream, self.path, chunk, keys, last)
            except RecordingError:
                continue
            if found:
                return found[0]
        return None

    def _holding(
        self, begin_ns: int, end_ns: int, wanted: Callable[[str], bool], chunks: Iterable[Chunk]
    ) -> Iterator[tuple[Chunk, dict[int, str], BinaryIO]]:
        """Yield the chunks with messages of some keys in a time span."""
        keys = {number: key for number, key in self.topics.items() if wanted(key)}
        with _opened(self.path) as stream:
            for chunk in chunks:
                is_then = chunk.end_ns >= begin_ns and chunk.begin_ns <= end_ns
                if is_then and not chunk.channels.keys().isdisjoint(keys):
                    yield chunk, keys, stream


def read_index(path: Path, known: RunIndex | None = None) -> RunIndex:
    """Scan a run's file.

    Args:
        path: The `.mcap`.
        known: Result of an earlier scan; if the file only grew, the scan continues there.

    Raises:
        RecordingError: when it is not an MCAP file or cannot be read.
    """
    with _opened(path) as stream:
        size = path.stat().st_size
        if known is not None and known.size == size:
            return known
        if stream.read(len(MAGIC)) != MAGIC:
            msg = f"{path}: no recording: an MCAP file begins otherwise"
            raise RecordingError(msg)
        complete = _summary(stream, path, size)
        if complete is not None:
            return complete
        grows = known is not None and not known.whole and known.size < size
        index = known if grows and known is not None else RunIndex(path, size, whole=False)
        return _walk(stream, index, size)


def _opened(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as cause:
        msg = f"{path}: cannot be read: {cause.strerror or cause}"
        raise RecordingError(msg) from cause


def _summary(stream: BinaryIO, path: Path, size: int) -> RunIndex | None:
    """Return the index of a complete file; None if it is incomplete."""
    try:
        stream.seek(-len(MAGIC), 2)
        if size < 2 * len(MAGIC) or stream.read(len(MAGIC)) != MAGIC:
            return None
        stream.seek(0)
        summary = make_reader(stream).get_summary()
    except UNREADABLE:
        return None
    if summary is None:
        return None
    chunks = tuple(
        _chunk_of(one)
        for one in sorted(summary.chunk_indexes, key=lambda one: one.chunk_start_offset)
        if 0 <= one.chunk_start_offset < size
    )
    topics = {number: channel.topic for number, channel in summary.channels.items()}
    return RunIndex(path, size, whole=True, chunks=chunks, topics=topics, read_to=size)


def _chunk_of(index: ChunkIndex) -> Chunk:
    return Chunk(
        index.message_start_time,
        index.message_end_time,
        index.chunk_start_offset + _RECORD.size,
        index.chunk_length - _RECORD.size,
        {number: at + _RECORD.size for number, at in index.message_index_offsets.items()},
    )


def _walk(stream: BinaryIO, index: RunIndex, size: int) -> RunIndex:
    """Scan an incomplete file; only complete chunks count."""
    chunks, topics = list(index.chunks), dict(index.topics)
    at = index.read_to or len(MAGIC)
    while at + _RECORD.size <= size:
        stream.seek(at)
        kind, length = _RECORD.unpack(stream.read(_RECORD.size))
        inside, after = at + _RECORD.size, at + _RECORD.size + length
        if after > size or kind in (0, DATA_END):
            break
        if kind == CHUNK and length >= _CHUNK.size:
            begin_ns, end_ns, *_ = _CHUNK.unpack(stream.read(_CHUNK.size))
            chunks.append(Chunk(begin_ns, end_ns, inside, length, {}))
        elif kind == MESSAGE_INDEX and chunks and length >= _U16.size:
            (number,) = _U16.unpack(stream.read(_U16.size))
            last = chunks[-1]
            chunks[-1] = last._replace(channels={**last.channels, number: inside})
            if number not in topics:
                topics |= _channels_in(stream, index.path, last)
        at = after
    return RunIndex(index.path, size, whole=False, chunks=tuple(chunks), topics=topics, read_to=at)


def _channels_in(stream: BinaryIO, path: Path, chunk: Chunk) -> dict[int, str]:
    """Return the channels that a chunk defines; none if it is damaged."""
    try:
        content = _unpacked(stream, path, chunk)
    except RecordingError:
        return {}
    return {
        number: key
        for kind, start, end in _records(content)
        if kind == CHANNEL
        for number, key in (_channel(content[start:end]),)
    }


def _channel(record: bytes) -> tuple[int, str]:
    """Return a channel's number and key."""
    (number,) = _U16.unpack_from(record)
    (length,) = _U32.unpack_from(record, 4)
    return number, record[8 : 8 + length].decode("utf-8", "replace")


def _places(
    stream: BinaryIO, path: Path, chunk: Chunk, keys: Mapping[int, str], begin_ns: int, end_ns: int
) -> list[tuple[int, int]]:
    """Return positions in a decompressed chunk and times of its messages, in order.

    Raises:
        RecordingError: when its message indexes are damaged.
    """
    found: list[tuple[int, int]] = []
    for number in chunk.channels.keys() & keys.keys():
        try:
            stream.seek(chunk.channels[number])
            _, size = _LIST.unpack(stream.read(_LIST.size))
            rows = _ENTRY.iter_unpack(stream.read(min(size, MAX_UNPACKED_BYTES)))
        except (struct.error, OverflowError, OSError) as cause:
            raise _damaged(path, chunk, cause) from cause
        found += [(at, t_ns) for t_ns, at in rows if begin_ns <= t_ns <= end_ns]
    return sorted(found)


def _messages(
    stream: BinaryIO,
    path: Path,
    chunk: Chunk,
    keys: Mapping[int, str],
    places: list[tuple[int, int]],
) -> list[Recorded]:
    """Return messages of a chunk, which is read only if any are wanted.

    Raises:
        RecordingError: when it is damaged or has a compression that the recorder does not use.
    """
    if not places:
        return []
    content = _unpacked(stream, path, chunk)
    found = []
    try:
        for start, t_ns in places:
            kind, length, number, _, log_ns, _ = _MESSAGE.unpack_from(content, start)
            end = start + _RECORD.size + length
            if kind != MESSAGE or log_ns != t_ns or end > len(content):
                raise _damaged(path, chunk, "its list of messages is not of its messages")
            found.append(Recorded(t_ns, keys[number], content[start + _MESSAGE.size : end]))
    except (struct.error, OverflowError, KeyError) as cause:
        raise _damaged(path, chunk, cause) from cause
    return found


def _log_ns(place: tuple[int, int]) -> int:
    return place[1]


def _records(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield the kind, begin and end of each complete record in a chunk's content."""
    at = 0
    while at + _RECORD.size <= len(content):
        kind, length = _RECORD.unpack_from(content, at)
        start = at + _RECORD.size
        at = start + length
        if at <= len(content):
            yield kind, start, at


def _unpacked(stream: BinaryIO, path: Path, chunk: Chunk) -> bytes:
    """Return a chunk's records.

    Raises:
        RecordingError: when it is damaged or has a compression that the recorder does not use.
    """
    stream.seek(chunk.start)
    record = stream.read(chunk.length)
    try:
        _, _, size, _, name_length = _CHUNK.unpack_from(record)
        at = _CHUNK.size + name_length
        packing, packed = record[_CHUNK.size : at], record[at + 8 :]
        if packing == b"":
            return packed
        if (
            packing != b"zstd"
            or max(size, zstandard.frame_content_size(packed)) > MAX_UNPACKED_BYTES
        ):
            msg = f"{path}: a chunk of {size} bytes packed as {packing[:20]!r} is none of ours"
            raise RecordingError(msg)
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    except UNREADABLE as cause:
        raise _damaged(path, chunk, cause) from cause


def _damaged(path: Path, chunk: Chunk, why: object) -> RecordingError:
    return RecordingError(f"{path}: the piece at byte {chunk.start} is damaged ({why})")
