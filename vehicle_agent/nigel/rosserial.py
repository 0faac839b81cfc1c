"""rosserial's frames, as bytes: what Nigel's Arduino and its host say to each other.

    FF FE | length, u16 | 255 - sum of the length's bytes | topic, u16 | payload
          | 255 - sum of the topic's and the payload's bytes

All little endian, sums modulo 256. Source: ros-drivers/rosserial, branch noetic-devel.
"""

import struct
from dataclasses import dataclass, field

from scm.clock import NS_PER_MS
from scm.errors import MessageError

PUBLISHER_INFO, SUBSCRIBER_INFO, PARAMETER, LOG, TIME, TX_STOP = 0, 1, 6, 7, 10, 11
"""Topics with a meaning of their own."""

FLOAT32 = "std_msgs/Float32"
FLOAT32_MD5 = "73fcbf46b49191e672908e50842a83d4"

SYNC = b"\xff\xfe"
HEAD = 5
AROUND = 8
LONGEST = 1024
"""Of a payload [bytes]: twice the largest buffer of the published firmwares (Mega: 512)."""

PATIENCE_NS = 50 * NS_PER_MS
"""For the rest of a frame: 280 bytes take 49 ms at 57600 baud."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One message: a topic's number and its payload."""

    topic: int
    payload: bytes = b""


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """What a device tells of one of its topics.

    Attributes:
        number: In its frames; subscribers count from 100, publishers from 125.
        buffer: The longest message that it takes [bytes].
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
        MessageError: when the payload is longer than `LONGEST` or the topic is no u16.
    """
    if len(frame.payload) > LONGEST or not 0 <= frame.topic <= 0xFFFF:
        msg = (
            f"rosserial frame: got topic {frame.topic} with {len(frame.payload)} bytes, "
            f"expected a topic of 0 to 65535 and at most {LONGEST} bytes"
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
        MessageError: when it is cut, has bytes too many or holds no text.
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
    """Frames out of a stream of bytes, whatever else is in it.

    A frame that fails a check is given up by one byte only, so nothing that begins inside it is
    lost. One whose end does not come in time is given up as well.

    Attributes:
        skipped: Bytes that belonged to no frame.
    """

    skipped: int = 0
    _held: bytearray = field(default_factory=bytearray)
    _came_ns: list[int] = field(default_factory=list)

    def feed(self, data: bytes, now_ns: int) -> list[Frame]:
        """Take bytes that came at `now_ns`; return the frames that they complete."""
        self._held += data
        self._came_ns += [now_ns] * len(data)
        frames = list[Frame]()
        while self._find_sync():
            size = self._size()
            if size == 0:
                self._drop(1)
            elif len(self._held) < size:
                if now_ns - self._came_ns[0] < PATIENCE_NS:
                    break
                self._drop(1)
            elif self._held[size - 1 : size] != _check(self._held[HEAD : size - 1]):
                self._drop(1)
            else:
                topic = struct.unpack_from("<H", self._held, HEAD)[0]
                frames.append(Frame(topic, bytes(self._held[HEAD + 2 : size - 1])))
                self._take(size)
        return frames

    def _find_sync(self) -> bool:
        """Drop what no frame begins in; return whether anything is left."""
        at = self._held.find(SYNC)
        if at < 0:
            at = len(self._held) - self._held.endswith(SYNC[:1])
        self._drop(at)
        return bool(self._held)

    def _size(self) -> int:
        """Return how long the frame at the front is, as far as one knows; 0: it is none."""
        if len(self._held) < HEAD:
            return HEAD
        length: int = struct.unpack_from("<H", self._held, 2)[0]
        is_one = self._held[4:5] == _check(self._held[2:4]) and length <= LONGEST
        return AROUND + length if is_one else 0

    def _drop(self, count: int) -> None:
        self._take(count)
        self.skipped += count

    def _take(self, count: int) -> None:
        del self._held[:count], self._came_ns[:count]


def _check(data: bytes | bytearray) -> bytes:
    return bytes([255 - sum(data) % 256])
