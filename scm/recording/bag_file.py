"""The raw messages of ROS bags, as far as intact: ROS 1, and ROS 2's SQLite and MCAP files.

A bag that is truncated or still being written is read up to the first invalid record. The folder
of a ROS 2 bag needs no `metadata.yaml`.
"""

import bz2
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import IO, Any, NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import yaml
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from rosbags.rosbag1 import Reader as Reader1

from scm.errors import RecordingError
from scm.recording import columns as limits
from scm.recording.columns import LeftOut, refuse_large

METADATA = "metadata.yaml"
OURS = "scm"  # the profile of a run of the city
ZSTD, ZSTD_SUFFIX = b"\x28\xb5\x2f\xfd", ".zstd"
SQLITE_PARTS = ("-wal", "-journal")  # beside a database that is being written, or was left so
ROS1_MAGIC = b"#ROSBAG V2.0\n"
CONNECTION, MESSAGE, CHUNK = 7, 2, 5  # records of a ROS 1 bag
ROS1, CDR = "ros1", "cdr"
CUT_OFF = "cut off, or still being written: read as far as it is whole"


class Topic(NamedTuple):
    """A topic of a bag.

    Attributes:
        kind: Type of its messages, as `nav_msgs/msg/Odometry`.
        encoding: Of its messages: `cdr` or `ros1`; others cannot be read.
        language: Of the type's definition: `msg` or `idl`, empty where the bag has none.
    """

    name: str
    kind: str
    encoding: str
    language: str = ""
    definition: str = ""


Raw = tuple[Topic, int, bytes]  # of which topic, when it was recorded [ns], and its bytes
Messages = Callable[[str], Iterator[Raw]]


@dataclass(slots=True)
class BagFile:
    """A bag that was opened.

    Attributes:
        topics: Those that its connections name; one a connection.
        messages: Yields the messages of a topic by its name.
        left_out: What of it cannot be read; it grows as messages are.
    """

    topics: list[Topic]
    messages: Messages
    left_out: list[LeftOut] = field(default_factory=list)


def open_bag(path: Path, stack: ExitStack) -> BagFile:
    """Open a bag, a file or the folder of a ROS 2 bag, until `stack` is closed.

    Raises:
        RecordingError: when nothing of it can be read.
    """
    if path.is_dir():
        return _open_folder(path, stack)
    if path.name.endswith(ZSTD_SUFFIX):
        path = _unpacked(path, stack)
    if path.suffix == ".db3":
        return _open_sqlite(path, stack)
    if path.suffix == ".mcap":
        return _open_mcap(path, stack)
    return _open_ros1(path, stack)


def _open_folder(folder: Path, stack: ExitStack) -> BagFile:
    """Open the files of a ROS 2 bag: those that its metadata name, or that are there."""
    whole = BagFile([], lambda _: iter(()))
    there = {path.name: path for path in folder.iterdir() if _is_part(path.name)}
    names = _named_files(folder) or sorted(
        name for name in there if name.removesuffix(ZSTD_SUFFIX) == name or name[:-5] not in there
    )
    parts = []
    for name in names:
        if name in there:
            parts.append(open_bag(there[name], stack))
        else:
            why = f"{METADATA} names it, but it is not there"
            whole.left_out.append(LeftOut(name, None, why))
    if not parts:
        msg = f"{folder}: no file of a ROS 2 bag is there, expected {', '.join(names)}"
        raise RecordingError(msg)

    def messages(topic: str) -> Iterator[Raw]:
        for part in parts:
            yield from part.messages(topic)
            whole.left_out += part.left_out
            part.left_out.clear()

    whole.topics = [topic for part in parts for topic in part.topics]
    whole.messages = messages
    return whole


def _is_part(name: str) -> bool:
    return name.removesuffix(ZSTD_SUFFIX).endswith((".db3", ".mcap"))


def _named_files(folder: Path) -> list[str]:
    """Return the files that a bag's metadata name; empty where that cannot be read."""
    with suppress(Exception):
        content = yaml.safe_load((folder / METADATA).read_text(encoding="utf-8"))
        paths = content["rosbag2_bagfile_information"]["relative_file_paths"]
        return [PurePath(path).name for path in paths]
    return []


def _unpacked(path: Path, stack: ExitStack) -> Path:
    """Unpack a file into a folder that goes away with `stack`."""
    folder = Path(stack.enter_context(TemporaryDirectory()))
    target = folder / path.name.removesuffix(ZSTD_SUFFIX)
    with path.open("rb") as packed, target.open("wb") as plain:
        zstandard.ZstdDecompressor().copy_stream(packed, plain)
    return target


def _as_it_was(data: bytes) -> bytes:
    """Return a message unpacked, where messages were packed one by one."""
    if data.startswith(ZSTD):
        return zstandard.decompress(data, limits.MAX_BYTES)
    return data


def _open_sqlite(path: Path, stack: ExitStack) -> BagFile:
    """Open a `.db3` file; what its writer has not yet merged into it (`-wal`) is read too."""
    beside = [path.with_name(path.name + part) for part in SQLITE_PARTS]
    uri = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
    bag = BagFile([], lambda _: iter(()))
    if any(part.is_file() and part.stat().st_size for part in beside):
        folder = Path(stack.enter_context(TemporaryDirectory()))
        for part in (path, *beside):
            if part.is_file():
                shutil.copyfile(part, folder / part.name)
        uri = (folder / path.name).as_uri()
    base = stack.enter_context(closing(sqlite3.connect(uri, uri=True)))
    definitions = {}
    with suppress(sqlite3.Error):  # bags before ROS 2 Iron have no such table
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        definitions = {kind: (language, text) for kind, language, text in base.execute(query)}
    ids: dict[int, Topic] = {}
    for number, name, kind, encoding in base.execute(
        "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
    ):
        language, text = definitions.get(kind, ("", ""))
        ids[number] = Topic(name, kind, encoding, language.removeprefix("ros2"), text)

    def messages(name: str) -> Iterator[Raw]:
        rows = 0
        try:
            for number in [number for number, topic in ids.items() if topic.name == name]:
                query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
                for t_ns, data in base.execute(query, (number,)):
                    rows += 1
                    yield ids[number], t_ns, _as_it_was(data)
        except sqlite3.Error as cause:
            if not rows:
                raise
            bag.left_out.append(LeftOut(path.name, None, f"damaged behind message {rows}: {cause}"))

    bag.topics, bag.messages = list(ids.values()), messages
    return bag


def _open_mcap(path: Path, stack: ExitStack) -> BagFile:
    """Open an MCAP file by its index, or without it."""
    stream = stack.enter_context(path.open("rb"))
    _refuse_run(stream, path)
    try:
        summary = make_reader(stream).get_summary()
    except Exception:  # noqa: BLE001  whatever a file without its end makes of the reader
        summary = None
    if summary is None or not summary.channels:
        return _scan_mcap(stream, path)
    topics = {
        number: _topic_of(channel, summary.schemas.get(channel.schema_id))
        for number, channel in summary.channels.items()
    }
    bag = BagFile(list(topics.values()), lambda _: iter(()))

    def messages(name: str) -> Iterator[Raw]:
        rows = 0
        try:
            reader = make_reader(stream, validate_crcs=True)
            for _, channel, message in reader.iter_messages(topics=[name]):
                rows += 1
                yield topics[channel.id], message.log_time, _as_it_was(message.data)
        except Exception as cause:
            if not rows:
                raise
            bag.left_out.append(LeftOut(path.name, None, f"damaged behind message {rows}: {cause}"))

    bag.messages = messages
    return bag


def _refuse_run(stream: IO[bytes], path: Path) -> None:
    """Refuse a run of the city, and leave the stream at its begin."""
    with suppress(McapError, struct.error, ValueError):
        profile = make_reader(stream).get_header().profile
        if profile == OURS:
            msg = f"{path}: no ROS bag; a run of this city is read as it is: scm replay {path}"
            raise RecordingError(msg)
    stream.seek(0)


def _topic_of(channel: Channel, schema: Schema | None) -> Topic:
    language, text = ("", "") if schema is None else (schema.encoding, schema.data.decode())
    kind = "" if schema is None else schema.name
    parts = kind.split("/")
    kind = "/msg/".join(parts) if len(parts) == 2 else kind
    language = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}.get(
        language, ""
    )
    return Topic(channel.topic, kind, channel.message_encoding, language, text)


def _scan_mcap(stream: IO[bytes], path: Path) -> BagFile:
    """Read an MCAP file without its index, as far as it goes."""
    stream.seek(0)
    schemas: dict[int, Schema] = {}
    topics: dict[int, Topic] = {}
    found: list[Raw] = []
    bag = BagFile([], lambda name: (one for one in found if one[0].name == name))
    size = 0
    try:
        for record in StreamReader(stream, record_size_limit=limits.MAX_BYTES).records:
            match record:
                case Schema():
                    schemas[record.id] = record
                case Channel():
                    topics[record.id] = _topic_of(record, schemas.get(record.schema_id))
                case Message():
                    size += len(record.data)
                    refuse_large(size, path)
                    raw = _as_it_was(record.data)
                    found.append((topics[record.channel_id], record.log_time, raw))
    except RecordingError:
        raise
    except Exception as cause:
        if not found:
            raise
        bag.left_out.append(LeftOut(path.name, None, f"{CUT_OFF} ({_words(cause)})"))
    bag.topics = list(topics.values())
    return bag


def _words(cause: Exception) -> str:
    return " ".join(str(cause).split())[: limits.MAX_NAMED * 2] or type(cause).__name__


def _open_ros1(path: Path, stack: ExitStack) -> BagFile:
    """Open a ROS 1 bag by its index, or without it."""
    reader = Reader1(path)
    try:
        reader.open()
    except PermissionError:
        raise
    except Exception:  # noqa: BLE001  whatever a file without its index makes of the reader
        return _scan_ros1(path)
    stack.callback(reader.close)
    topics = {
        one.id: Topic(one.topic, one.msgtype, ROS1, "msg", one.msgdef.data)
        for one in reader.connections
    }
    bag = BagFile(list(topics.values()), lambda _: iter(()))

    def messages(name: str) -> Iterator[Raw]:
        rows = 0
        try:
            connections = [one for one in reader.connections if one.topic == name]
            for one, t_ns, raw in reader.messages(connections=connections) if connections else ():
                rows += 1
                yield topics[one.id], t_ns, raw
        except Exception as cause:
            if not rows:
                raise
            bag.left_out.append(LeftOut(path.name, None, f"damaged behind message {rows}: {cause}"))

    bag.messages = messages
    return bag


def _scan_ros1(path: Path) -> BagFile:
    """Read a ROS 1 bag without its index, as far as it goes."""
    topics: dict[int, Topic] = {}
    found: list[Raw] = []
    bag = BagFile([], lambda name: (one for one in found if one[0].name == name))
    with path.open("rb") as stream:
        if stream.read(len(ROS1_MAGIC)) != ROS1_MAGIC:
            msg = (
                f"{path}: not a ROS 1 bag: expected it to begin with {ROS1_MAGIC.decode().strip()}"
            )
            raise RecordingError(msg)
        size = 0
        try:
            for header, data in _ros1_records(stream):
                size += len(data)
                refuse_large(size, path)
                _read_ros1(header, data, topics, found)
        except RecordingError:
            raise
        except Exception as cause:  # noqa: BLE001  whatever a torn record makes of its readers
            why = f"{CUT_OFF} ({_words(cause)}); `rosbag reindex` may find more"
            bag.left_out.append(LeftOut(path.name, None, why))
        else:
            why = f"has no index: {CUT_OFF}; `rosbag reindex` makes one"
            bag.left_out.append(LeftOut(path.name, None, why))
    if not found:
        msg = f"{path}: holds no whole message: {bag.left_out[0].why}"
        raise RecordingError(msg)
    bag.topics = list(topics.values())
    return bag


def _ros1_records(stream: IO[bytes]) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """Yield the records of a ROS 1 bag, of chunks what is in them.

    Raises:
        ValueError: where the stream ends within a record.
    """
    while length := stream.read(4):
        header = _ros1_fields(_exactly(stream, _u32(length)))
        data = _exactly(stream, _u32(_exactly(stream, 4)))
        if header[b"op"] == bytes([CHUNK]):
            yield from _ros1_records(BytesIO(_ros1_chunk(header, data)))
        else:
            yield header, data


def _ros1_chunk(header: dict[bytes, bytes], data: bytes) -> bytes:
    """Return the content of a chunk; what it declares is not believed."""
    if _u32(header[b"size"]) > limits.MAX_BYTES:
        msg = "a chunk that declares more than fits into memory"
        raise ValueError(msg)
    unpack: dict[bytes, Callable[[bytes], Any]] = {
        b"none": bytes, b"bz2": bz2.decompress, b"lz4": lz4.frame.decompress,
    }  # fmt: skip
    return bytes(unpack[header[b"compression"]](data))


def _ros1_fields(data: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(data):
        length = _u32(data[at : at + 4])
        name, _, value = data[at + 4 : at + 4 + length].partition(b"=")
        fields[name], at = value, at + 4 + length
    return fields


def _read_ros1(
    header: dict[bytes, bytes], data: bytes, topics: dict[int, Topic], found: list[Raw]
) -> None:
    """Note a connection or a message; other records belong to the index."""
    if header[b"op"] == bytes([CONNECTION]):
        about = _ros1_fields(data)
        kind = about[b"type"].decode().replace("/", "/msg/", 1)
        name = "/" + "/".join(part for part in header[b"topic"].decode().split("/") if part)
        text = about[b"message_definition"].decode(errors="replace")
        topics[_u32(header[b"conn"])] = Topic(name, kind, ROS1, "msg", text)
    elif header[b"op"] == bytes([MESSAGE]):
        sec, nsec = struct.unpack("<II", header[b"time"])
        found.append((topics[_u32(header[b"conn"])], sec * limits.NS_PER_S + nsec, data))


def _u32(data: bytes) -> int:
    value: int = struct.unpack("<I", data)[0]
    return value


def _exactly(stream: IO[bytes], length: int) -> bytes:
    if length > limits.MAX_BYTES:
        msg = f"a record that declares {length} bytes"
        raise ValueError(msg)
    data = stream.read(length)
    if len(data) != length:
        msg = f"a record of {length} bytes ends after {len(data)}"
        raise ValueError(msg)
    return data
