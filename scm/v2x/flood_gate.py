"""Rate limit per key: messages beyond it are dropped and counted without decoding.

It affects only the key that is flooded, not other keys of the same connection. The city's own parts
stay far below the limits.
"""

from scm.clock import NS_PER_S

MESSAGES_A_SECOND = 2000
BYTES_A_SECOND = 200_000_000
"""Per key: raw 4K pictures at 8 Hz."""


class FloodGate:
    """Counts the messages on each key, second by second.

    Attributes:
        dropped: Number of messages dropped since the start.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._began_ns = 0
        self._count: dict[str, int] = {}
        self._bytes: dict[str, int] = {}

    def admits(self, key: str, size: int, now_ns: int) -> bool:
        """Return whether to read a message of so many bytes on a key."""
        if not 0 <= now_ns - self._began_ns < NS_PER_S:
            self._began_ns = now_ns
            self._count.clear()
            self._bytes.clear()
        count = self._count[key] = self._count.get(key, 0) + 1
        total = self._bytes[key] = self._bytes.get(key, 0) + size
        if count > MESSAGES_A_SECOND or total > BYTES_A_SECOND:
            self.dropped += 1
            return False
        return True
