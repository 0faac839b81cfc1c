"""A serial line with the Arduino's buffers at its end: each byte takes its time.

Bytes that arrive while 63 bytes are unread are lost; a write of more than 64 bytes blocks.
"""

import math
from collections import deque

from scm.clock import NS_PER_S

BITS_PER_BYTE = 10  # start, eight data, stop
BUFFER_BYTES = 63  # of HardwareSerial, one of 64 stays empty
NOTHING = -1
IDLE = 1


class Uart:
    """The device's end.

    Attributes:
        lost: Bytes lost to a full buffer.
    """

    def __init__(self, baud: int) -> None:
        self.byte_ns = BITS_PER_BYTE * NS_PER_S // baud
        self.lost = 0
        self._coming: deque[tuple[int, int]] = deque()
        self._ring: deque[int] = deque()
        self._going: deque[tuple[int, int]] = deque()
        self._came_ns = self._went_ns = 0

    def put(self, data: bytes, now_ns: int) -> None:
        """Send bytes from the host's end, after those already in transit."""
        for byte in data:
            self._came_ns = max(self._came_ns, now_ns) + self.byte_ns
            self._coming.append((self._came_ns, byte))

    def backlog_ns(self, now_ns: int) -> int:
        """Return how long the line is occupied by bytes that the host sent already."""
        return max(0, self._came_ns - now_ns)

    def arrive(self, now_ns: int, *, deaf: bool = False) -> None:
        """Receive the bytes that have arrived; discard them if `deaf`."""
        while self._coming and self._coming[0][0] <= now_ns:
            _, byte = self._coming.popleft()
            if deaf:
                continue
            if len(self._ring) < BUFFER_BYTES:
                self._ring.append(byte)
            else:
                self.lost += 1

    def read(self) -> int:
        """Return the next byte, -1 when there is none."""
        return self._ring.popleft() if self._ring else NOTHING

    def write(self, data: bytes, now_ns: int) -> int:
        """Send to the host; return when the call returns [ns]: when all fits the buffer."""
        for byte in data:
            self._went_ns = max(self._went_ns, now_ns) + self.byte_ns
            self._going.append((self._went_ns, byte))
        return max(now_ns, self._went_ns - (BUFFER_BYTES + 1) * self.byte_ns)

    def sent(self, now_ns: int) -> bytes:
        """Return the bytes that have left the device."""
        out = bytearray()
        while self._going and self._going[0][0] <= now_ns:
            out.append(self._going.popleft()[1])
        return bytes(out)

    def clear(self, now_ns: int) -> None:
        """Clear the device's buffers, as a reset does; the line itself continues."""
        self._ring.clear()
        self._going.clear()
        self._went_ns = now_ns


def received_bytes(data: bytes, sent_baud: int, read_baud: int) -> bytes:
    """Return the bytes that a UART at `read_baud` receives from a burst sent without pauses.

    It waits for a falling edge that is still low half a bit later, and then samples the middle of
    each of its own eight bits, whatever the sender meant by them. Wrong stop bits are ignored: the
    Arduino core accepts such bytes. At 0 baud nothing is received.
    """
    if sent_baud == read_baud:
        return data
    if 0 in (sent_baud, read_baud):
        return b""
    bits = [IDLE]
    for byte in data:
        bits += [0, *((byte >> at) & 1 for at in range(8)), 1]
    step, out, at = sent_baud / read_baud, bytearray(), 1
    while (edge := _falling(bits, at)) is not None:
        if _level(bits, edge + step * 0.5):
            at = edge + 1
            continue
        level = [_level(bits, edge + step * (k + 1.5)) for k in range(8)]
        out.append(sum(bit << k for k, bit in enumerate(level)))
        at = math.ceil(edge + step * 9.5)
    return bytes(out)


def _falling(bits: list[int], begin: int) -> int | None:
    for at in range(begin, len(bits)):
        if bits[at] == 0 and bits[at - 1] == 1:
            return at
    return None


def _level(bits: list[int], at: float) -> int:
    return bits[int(at)] if at < len(bits) else IDLE
