"""Leave cleanly: say goodbye, wait for the city's answer, and only then end the process.

A process that ends at once looks to the city like one that died.
"""

import threading
from collections.abc import Sequence

from scm.clock import NS_PER_MS
from scm.runtime.part import IsWanted, Part, Subscription
from scm.v2x.exchange import Incoming, Outgoing

MAX_GOODBYE_NS = 900 * NS_PER_MS


class Leaving:
    """A part that runs until a stop is requested, and then until its goodbye is answered.

    Args:
        part: Does everything else.
        stop_requested: Set by whoever wants it to end.
        done: Set by this part when it has left; stops the runner.
    """

    def __init__(self, part: Part, stop_requested: threading.Event, done: threading.Event) -> None:
        self.name, self.role, self.period_ns = part.name, part.role, part.period_ns
        self.services = part.services
        self._part, self._stop_requested, self._done = part, stop_requested, done
        self._since_ns: int | None = None
        self._waiting = 0

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """The part's present subscriptions."""
        return self._part.subscriptions

    def attach(self, is_wanted: IsWanted) -> None:
        """Let the part check for subscribers."""
        self._part.attach(is_wanted)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Step the part, or wait for the answers to its goodbye."""
        if self._since_ns is not None:
            self._waiting -= sum(item.call is not None for item in inbox)
            if self._waiting <= 0 or now_ns - self._since_ns >= MAX_GOODBYE_NS:
                self._done.set()
            return []
        if not self._stop_requested.is_set():
            return self._part.step(now_ns, inbox)
        farewell = self._part.finish(now_ns)
        self._since_ns, self._waiting = now_ns, len(farewell)
        return farewell

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Return the goodbye, unless it was sent already."""
        return [] if self._since_ns is not None else self._part.finish(now_ns)
