"""rosserial as in the Arduino library: a parser of one byte at a time, and the handshake.

Unlike a host's, it never looks back: in `FF FF FE ...` the second FF discards the first frame and
the frame behind it is lost, and a frame that fails a check discards all its bytes.
Source of the rules: ros-drivers/rosserial, noetic-devel, `node_handle.h`.
"""

import struct
from collections.abc import Callable

from vehicle_agent.emulate.avr import int16
from vehicle_agent.emulate.uart import NOTHING
from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    PUBLISHER_INFO,
    SUBSCRIBER_INFO,
    TIME,
    TX_STOP,
    Frame,
    TopicInfo,
    pack,
    pack_topic_info,
)

FIRST_TOPIC = 100
FRAME_MS = 20
TIME_REQUEST_MS = 2500
FORGET_MS = 11000
LAST_EMPTY = 126
"""Up to this topic the library's lookup reads zeros: behind 25 subscribers lie the parser's state
and its count, both 0 when a frame is complete, and then its topic."""
TIME_REQUEST = pack(Frame(TIME, bytes(8)))

FIRST_FF, VERSION, SIZE_L, SIZE_H, SIZE_CHECK, TOPIC_L, TOPIC_H, MESSAGE, CHECK = range(9)


class NodeHandle:
    """The library's object in the sketch.

    Args:
        names: Of the subscribers, in the order in which the sketch subscribes.
        buffer: Of a message [bytes].
        on_message: Called with a subscriber's index and its Float32, whether a host is connected
            or not.
        write: Sends bytes.

    Attributes:
        configured: Whether a host has requested the topics and still sends the time.
        has_crashed: Whether it called a subscriber that does not exist, at an address made of its
            own variables. The behaviour from there on is undefined.
    """

    def __init__(
        self,
        names: tuple[str, ...],
        buffer: int,
        on_message: Callable[[int, float], None],
        write: Callable[[bytes], None],
    ) -> None:
        self._infos = [
            TopicInfo(FIRST_TOPIC + at, name, FLOAT32, FLOAT32_MD5, buffer)
            for at, name in enumerate(names)
        ]
        self._on_message, self._write = on_message, write
        self.configured = self.has_crashed = False
        self._message = bytearray(buffer)
        self._mode = FIRST_FF
        self._left = self._topic = self._index = self._sum = 0
        self._synced_ms = self._time_requested_ms = self._until_ms = 0

    def spin(self, now_ms: int, read: Callable[[], int]) -> None:
        """Read available bytes, and request the time when due: `spinOnce`.

        Args:
            now_ms: Time since the reset.
            read: Returns the next byte, or -1.
        """
        if now_ms - self._synced_ms > FORGET_MS:
            self.configured = False
        if self._mode != FIRST_FF and now_ms > self._until_ms:
            self._mode = FIRST_FF
        while (byte := read()) != NOTHING:
            if self._parse(byte, now_ms) and self._dispatch(now_ms):
                return
        if self.configured and now_ms - self._time_requested_ms > TIME_REQUEST_MS:
            self._write(TIME_REQUEST)
            self._time_requested_ms = now_ms

    def _parse(self, byte: int, now_ms: int) -> bool:
        """Process one byte; return whether it completes a frame."""
        self._sum = int16(self._sum + byte)
        if self._mode == MESSAGE:
            self._store(byte)
        elif self._mode == FIRST_FF:
            if byte == 0xFF:
                self._mode, self._until_ms = VERSION, now_ms + FRAME_MS
        elif self._mode == VERSION:
            self._check_version(byte)
        elif self._mode in (SIZE_L, SIZE_H, SIZE_CHECK):
            self._parse_size(byte)
        elif self._mode == CHECK:
            self._mode = FIRST_FF
            return self._is_sum_right()
        else:
            self._parse_topic(byte)
        return False

    def _check_version(self, byte: int) -> None:
        if byte == 0xFE:
            self._mode = SIZE_L
            return
        self._mode = FIRST_FF
        if not self.configured:
            self._write(TIME_REQUEST)

    def _parse_size(self, byte: int) -> None:
        if self._mode == SIZE_L:
            self._left, self._index, self._sum, self._mode = byte, 0, byte, SIZE_H
        elif self._mode == SIZE_H:
            self._left, self._mode = int16(self._left + (byte << 8)), SIZE_CHECK
        else:
            self._mode = TOPIC_L if self._is_sum_right() else FIRST_FF

    def _parse_topic(self, byte: int) -> None:
        if self._mode == TOPIC_L:
            self._topic, self._sum, self._mode = byte, byte, TOPIC_H
        else:
            self._topic = int16(self._topic + (byte << 8))
            self._mode = MESSAGE if self._left else CHECK

    def _store(self, byte: int) -> None:
        """Store a byte; a frame times out after 20 ms, long before the buffer is full."""
        self._message[self._index] = byte
        self._index += 1
        self._left -= 1
        if self._left == 0:
            self._mode = CHECK

    def _is_sum_right(self) -> bool:
        return self._sum >= 0 and self._sum % 256 == 255  # C's % of a negative sum is never 255

    def _dispatch(self, now_ms: int) -> bool:
        """Process a frame; return whether `spinOnce` returns here, whatever else was received."""
        place = self._topic - FIRST_TOPIC
        if self._topic == PUBLISHER_INFO:
            self._negotiate(now_ms)
            return True
        if self._topic == TIME:
            self._synced_ms = now_ms
        elif self._topic == TX_STOP:
            self.configured = False
        elif 0 <= place < len(self._infos):
            self._on_message(place, struct.unpack_from("<f", self._message)[0])
        elif not 0 < self._topic <= LAST_EMPTY:
            self.has_crashed = True
            return True
        return False

    def _negotiate(self, now_ms: int) -> None:
        self._write(TIME_REQUEST)
        for info in self._infos:
            self._write(pack(Frame(SUBSCRIBER_INFO, pack_topic_info(info))))
        self.configured = True
        self._synced_ms = self._time_requested_ms = now_ms
