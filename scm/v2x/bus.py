"""The bus contract: publish, subscribe, ask, answer, and know who is there.

Two buses keep it: `ZenohBus` between processes and machines, `MemoryBus` inside one. The same
contract test runs over both. Nothing here calls back into a part: what arrives waits in a bounded
`Mailbox` until its owner drains it, the oldest dropped (and counted) when it is full.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Protocol

from scm.v2x.exchange import Answer, Call, Incoming
from scm.v2x.message import Message, Request


class Mailbox:
    """A bounded queue between the bus and its one reader: drop oldest, count drops."""

    def __init__(self, depth: int, wake: threading.Event | None = None) -> None:
        self._items: deque[Incoming] = deque(maxlen=depth)
        self._lock = threading.Lock()
        self._wake = wake
        self.dropped = 0

    def put(self, item: Incoming) -> None:
        """Add an item; called by the bus, from any thread."""
        with self._lock:
            if len(self._items) == self._items.maxlen:
                self.dropped += 1
            self._items.append(item)
        if self._wake is not None:
            self._wake.set()

    def drain(self) -> list[Incoming]:
        """Return and forget everything that waits, oldest first."""
        with self._lock:
            items = list(self._items)
            self._items.clear()
        return items


class Bus(Protocol):
    """One station's connection to its city; a context manager that always closes.

    Attributes:
        city: Whose keys are used.
        station: The name this connection is known by.
    """

    city: str
    station: str

    def publish(self, message: Message) -> None:
        """Send a message on its own key; never blocks for a slow receiver."""
        ...

    def subscribe(self, kind: type[Message], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Bring messages of a class into a mailbox until the bus is closed."""
        ...

    def serve(self, kind: type[Request], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Bring requests of a class into a mailbox; each waits there for its `answer`."""
        ...

    def answer(self, answer: Answer) -> None:
        """Reply to a request that came from `serve`; a second answer to the same is ignored."""
        ...

    def call(self, call: Call, on_reply: Callable[[Incoming], None]) -> None:
        """Ask, and hand the reply (or a `Refused`) to `on_reply` later; never blocks.

        `on_reply` runs on a thread of the bus: it may only fill a mailbox or set an event.
        """
        ...

    def announce(self, role: str) -> None:
        """Declare this station present until the bus closes or its process dies."""
        ...

    def close(self) -> None:
        """Leave; safe to call twice."""
        ...

    def __enter__(self) -> "Bus": ...

    def __exit__(self, *exc: object) -> None: ...
