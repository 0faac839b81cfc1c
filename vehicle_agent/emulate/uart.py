"""A serial line and the Arduino's buffers at its end: each byte takes its time.

What comes while 63 bytes wait to be read is lost; who writes more than 64 at once waits.
"""

from collections import deque

from scm.clock import NS_PER_S

BITS = 10
RING = 63
NOTHING = -1


class Uart:
    """The device's end.

    Attributes:
        lost: Bytes that came while the ring was full.
    """

    def __init__(self, baud: int) -> None:
        self.byte_ns = BITS * NS_PER_S // baud
        self.lost = 0
        self._coming: deque[tuple[int, int]] = deque()
        self._ring: deque[int] = deque()
        self._going: deque[tuple[int, int]] = deque()
        self._came_ns = self._went_ns = 0

    def put(self, data: bytes, now_ns: int) -> None:
        """Send bytes from the host's end, after those that are still on their way."""
        for byte in data:
            self._came_ns = max(self._came_ns, now_ns) + self.byte_ns
            self._coming.append((self._came_ns, byte))

    def backlog_ns(self, now_ns: int) -> int:
        """Return for how long the line is taken by what the host sent already."""
        return max(0, self._came_ns - now_ns)

    def arrive(self, now_ns: int, *, deaf: bool = False) -> None:
        """Take in what has come by now; whoever is deaf throws it away."""
        while self._coming and self._coming[0][0] <= now_ns:
            _, byte = self._coming.popleft()
            if deaf:
                continue
            if len(self._ring) < RING:
                self._ring.append(byte)
            else:
                self.lost += 1

    def read(self) -> int:
        """Return the next byte, -1 when there is none."""
        return self._ring.popleft() if self._ring else NOTHING

    def write(self, data: bytes, now_ns: int) -> int:
        """Send to the host; return when the call is over [ns]: when all fits the buffer."""
        for byte in data:
            self._went_ns = max(self._went_ns, now_ns) + self.byte_ns
            self._going.append((self._went_ns, byte))
        return max(now_ns, self._went_ns - (RING + 1) * self.byte_ns)

    def sent(self, now_ns: int) -> bytes:
        """Return what has left the device by now."""
        out = bytearray()
        while self._going and self._going[0][0] <= now_ns:
            out.append(self._going.popleft()[1])
        return bytes(out)

    def clear(self, now_ns: int) -> None:
        """Forget all that is in the device, as a reset does; the line itself goes on."""
        self._ring.clear()
        self._going.clear()
        self._went_ns = now_ns
