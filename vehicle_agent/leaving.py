"""Leave politely: say goodbye, wait for the city's answer, and only then end the process.

A process that ends at once looks to the city like one that died.
"""

import threading
from collections.abc import Sequence

from scm.clock import NS_PER_MS
from scm.runtime.part import IsWanted, Part, Subscription
from scm.v2x.exchange import Incoming, Outgoing

PATIENCE_NS = 900 * NS_PER_MS


class Leaving:
    """A part that runs until it is asked to end, and then until its last words are answered.

    Args:
        part: Does everything else.
        wish: Set by whoever wants it to end.
        done: Set by this when it may; stops the runner.
    """

    def __init__(self, part: Part, wish: threading.Event, done: threading.Event) -> None:
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self._part, self._wish, self._done = part, wish, done
        self._since_ns: int | None = None
        self._waiting = 0

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """What the part wishes to hear now."""
        return self._part.subscriptions

    def attach(self, is_wanted: IsWanted) -> None:
        """Let the part check for subscribers."""
        self._part.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Let the part live, or wait for the answers to its last words."""
        if self._since_ns is not None:
            self._waiting -= sum(item.call is not None for item in inbox)
            if self._waiting <= 0 or now_ns - self._since_ns >= PATIENCE_NS:
                self._done.set()
            return []
        if not self._wish.is_set():
            return self._part.step(now_ns, inbox)
        last_words = self._part.finish(now_ns)
        self._since_ns, self._waiting = now_ns, len(last_words)
        return last_words

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Say nothing more, unless nothing was said yet."""
        return [] if self._since_ns is not None else self._part.finish(now_ns)
