"""Bounded queues between the bus and one reader: drop oldest, count drops.

Arriving bytes are decoded when the reader pops them, on the reader's thread; dropped items are
never decoded.
"""

import itertools
import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

from scm.v2x.exchange import Incoming, RawSample

T = TypeVar("T")

_arrivals = itertools.count()


class Queue(Generic[T]):
    """A bounded queue; `put` from any thread, `drain` from one.

    Attributes:
        dropped: Number of items dropped for newer ones.
    """

    def __init__(self, depth: int, wake: threading.Event | None = None) -> None:
        self._items: deque[tuple[int, Callable[[], T | None]]] = deque(maxlen=depth)
        self._lock = threading.Lock()
        self._wake = wake
        self.dropped = 0

    def put(self, item: T) -> None:
        """Add an item."""
        self.put_later(lambda: item)

    def put_later(self, make: Callable[[], T | None]) -> None:
        """Add an item that `make` builds when it is popped; None is skipped."""
        with self._lock:
            if len(self._items) == self._items.maxlen:
                self.dropped += 1
            self._items.append((next(_arrivals), make))
        if self._wake is not None:
            self._wake.set()

    def pop_all(self) -> list[tuple[int, Callable[[], T | None]]]:
        """Remove and return all waiting items, unbuilt, each with its order of arrival."""
        if not self._items:
            return []
        with self._lock:
            items = list(self._items)
            self._items.clear()
        return items

    def drain(self) -> list[T]:
        """Remove and return all waiting items, oldest first."""
        return [item for _, make in self.pop_all() if (item := make()) is not None]


class Mailbox(Queue[Incoming]):
    """A queue of messages, requests and replies.

    Args:
        depth: Maximum number of waiting items.
        wake: Set whenever an item is added.
        keep: Filter; other items are not queued. All items are then decoded on arrival, on the
            bus's thread.
        once: Read only the first of copies that differ just in the first variable part of their
            key: one radio frame for several receivers.
    """

    def __init__(
        self,
        depth: int,
        wake: threading.Event | None = None,
        keep: Callable[[Incoming], bool] | None = None,
        *,
        once: bool = False,
    ) -> None:
        super().__init__(depth, wake)
        self._keep = keep
        self.once = once

    def put_later(self, make: Callable[[], Incoming | None]) -> None:
        """Add an item that is built when it is popped, or now if there is a filter."""
        if self._keep is None:
            super().put_later(make)
            return
        item = make()
        if item is not None and self._keep(item):
            super().put_later(lambda: item)


class RawMailbox(Queue[RawSample]):
    """A queue of undecoded samples."""


def drain_all(boxes: Iterable[Mailbox | RawMailbox]) -> list[Incoming | RawSample]:
    """Empty several queues of one reader into one list, in order of arrival."""
    waiting: list[tuple[int, Callable[[], Incoming | RawSample | None]]] = []
    for box in boxes:
        waiting.extend(box.pop_all())
    waiting.sort(key=lambda item: item[0])
    return [item for _, make in waiting if (item := make()) is not None]
