"""How much of one key a reader takes in: what is beyond is dropped and counted, unread.

Whoever says too much on a key is heard less on that key; everything else that the same connection
brings is read as before. No part of ours comes near the limits.
"""

from scm.clock import NS_PER_S

MESSAGES_A_SECOND = 2000
BYTES_A_SECOND = 200_000_000
"""Of one key: raw 4K pictures eight times a second."""


class FloodGate:
    """Counts what comes on each key, second by second.

    Attributes:
        dropped: How many were not let through since the start.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._began_ns = 0
        self._count: dict[str, int] = {}
        self._bytes: dict[str, int] = {}

    def admits(self, key: str, size: int, now_ns: int) -> bool:
        """Return whether to read what came on a key, of so many bytes."""
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
