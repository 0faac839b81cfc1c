"""Frames on their way: what is delivered late waits here until its time."""

import heapq

from scm.v2x.message import Message


class Late:
    """Frames by the time they arrive; those of one time in the order they were put in."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, int, Message]] = []
        self._count = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, due_ns: int, frame: Message) -> None:
        """Let a frame arrive at a time."""
        self._count += 1
        heapq.heappush(self._waiting, (due_ns, self._count, frame))

    def arrived(self, now_ns: int) -> list[Message]:
        """Return and forget the frames that have arrived by now."""
        frames = []
        while self._waiting and self._waiting[0][0] <= now_ns:
            frames.append(heapq.heappop(self._waiting)[2])
        return frames
