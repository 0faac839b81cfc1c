"""rosserial's frames as bytes, between Nigel's Arduino and its host.

    FF FE | length, u16 | 255 - sum of the length's bytes | topic, u16 | payload
          | 255 - sum of the topic's and the payload's bytes

All little endian, sums modulo 256. Source: ros-drivers/rosserial, branch noetic-devel.
"""

import struct
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS
from scm.errors import MessageError

PUBLISHER_INFO, SUBSCRIBER_INFO, PARAMETER, LOG, TIME, TX_STOP = 0, 1, 6, 7, 10, 11
"""Topics with a fixed meaning."""

FLOAT32 = "std_msgs/Float32"
FLOAT32_MD5 = "73fcbf46b49191e672908e50842a83d4"

SYNC = b"\xff\xfe"
HEADER_BYTES = 5
OVERHEAD_BYTES = 8
MAX_PAYLOAD_BYTES = 1024
"""Twice the largest buffer of the published firmwares (Mega: 512)."""

FRAME_TIMEOUT_NS = 50 * NS_PER_MS
"""Maximum time for the rest of a frame: 280 bytes take 49 ms at 57600 baud."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One message: a topic's number and its payload."""

    topic: int
    payload: bytes = b""


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A device's announcement of one of its topics.

    Attributes:
        number: In its frames; subscribers count from 100, publishers from 125.
        buffer: Size of the longest message [bytes].
    """

    number: int
    name: str
    kind: str
    md5: str
    buffer: int


REQUEST_TOPICS = Frame(PUBLISHER_INFO)
STOP_SENDING = Frame(TX_STOP)


def pack(frame: Frame) -> bytes:
    """Return a frame's bytes.

    Raises:
        MessageError: when the payload is longer than `MAX_PAYLOAD_BYTES` or the topic is no u16.
    """
    if len(frame.payload) > MAX_PAYLOAD_BYTES or not 0 <= frame.topic <= 0xFFFF:
        msg = (
            f"rosserial frame: got topic {frame.topic} with {len(frame.payload)} bytes, "
            f"expected a topic of 0 to 65535 and at most {MAX_PAYLOAD_BYTES} bytes"
        )
        raise MessageError(msg)
    length = struct.pack("<H", len(frame.payload))
    body = struct.pack("<H", frame.topic) + frame.payload
    return SYNC + length + _check(length) + body + _check(body)


def pack_float(value: float) -> bytes:
    """Return a std_msgs/Float32's payload."""
    return struct.pack("<f", value)


def unpack_float(payload: bytes) -> float:
    """Return a std_msgs/Float32's value; MessageError when it is not 4 bytes long."""
    if len(payload) != 4:
        msg = f"{FLOAT32}: got {len(payload)} bytes, expected 4"
        raise MessageError(msg)
    value: float = struct.unpack("<f", payload)[0]
    return value


def pack_time(t_ns: int) -> bytes:
    """Return a std_msgs/Time's payload: whole seconds and nanoseconds since the epoch."""
    sec, nsec = divmod(t_ns, 1_000_000_000)
    return struct.pack("<II", sec & 0xFFFFFFFF, nsec)


def pack_topic_info(info: TopicInfo) -> bytes:
    """Return the payload of a publisher's or a subscriber's announcement."""
    texts = [text.encode() for text in (info.name, info.kind, info.md5)]
    parts = [struct.pack("<I", len(text)) + text for text in texts]
    return struct.pack("<H", info.number) + b"".join(parts) + struct.pack("<i", info.buffer)


def unpack_topic_info(payload: bytes) -> TopicInfo:
    """Read an announcement.

    Raises:
        MessageError: when it is truncated, too long or not text.
    """
    try:
        number, at, texts = struct.unpack_from("<H", payload)[0], 2, list[str]()
        for _ in range(3):
            (length,) = struct.unpack_from("<I", payload, at)
            texts.append(payload[at + 4 : at + 4 + length].decode())
            at += 4 + length
        (buffer,) = struct.unpack_from("<i", payload, at)
    except (struct.error, UnicodeDecodeError) as cause:
        msg = f"rosserial topic info of {len(payload)} bytes: {cause}"
        raise MessageError(msg) from cause
    if at + 4 != len(payload):
        msg = f"rosserial topic info: got {len(payload)} bytes, expected {at + 4}"
        raise MessageError(msg)
    name, kind, md5 = texts
    return TopicInfo(number, name, kind, md5, buffer)


@dataclass(slots=True)
class Decoder:
    """Extracts frames from a stream of bytes with anything else in it.

    After a frame that fails a check only one byte is skipped, so a frame that begins inside it is
    found. A frame whose end does not arrive in time is skipped as well.

    Attributes:
        skipped: Number of bytes outside frames.
    """

    skipped: int = 0
    _buffer: bytearray = field(default_factory=bytearray)
    _came_ns: list[int] = field(default_factory=list)

    def feed(self, data: bytes, now_ns: int) -> list[Frame]:
        """Process bytes received at `now_ns`; return the frames they complete."""
        self._buffer += data
        self._came_ns += [now_ns] * len(data)
        frames = list[Frame]()
        while self._find_sync():
            size = self._size()
            if size == 0:
                self._drop(1)
            elif len(self._buffer) < size:
                if now_ns - self._came_ns[0] < FRAME_TIMEOUT_NS:
                    break
                self._drop(1)
            elif self._buffer[size - 1 : size] != _check(self._buffer[HEADER_BYTES : size - 1]):
                self._drop(1)
            else:
                topic = struct.unpack_from("<H", self._buffer, HEADER_BYTES)[0]
                frames.append(Frame(topic, bytes(self._buffer[HEADER_BYTES + 2 : size - 1])))
                self._consume(size)
        return frames

    def _find_sync(self) -> bool:
        """Drop bytes before the next sync; return whether anything is left."""
        at = self._buffer.find(SYNC)
        if at < 0:
            at = len(self._buffer) - self._buffer.endswith(SYNC[:1])
        self._drop(at)
        return bool(self._buffer)

    def _size(self) -> int:
        """Return the length of the frame at the front, as far as known; 0 if there is none."""
        if len(self._buffer) < HEADER_BYTES:
            return HEADER_BYTES
        length: int = struct.unpack_from("<H", self._buffer, 2)[0]
        is_one = self._buffer[4:5] == _check(self._buffer[2:4]) and length <= MAX_PAYLOAD_BYTES
        return OVERHEAD_BYTES + length if is_one else 0

    def _drop(self, count: int) -> None:
        self._consume(count)
        self.skipped += count

    def _consume(self, count: int) -> None:
        del self._buffer[:count], self._came_ns[:count]


def _check(data: bytes | bytearray) -> bytes:
    return bytes([255 - sum(data) % 256])
