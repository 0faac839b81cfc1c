"""The last events of the city, numbered in order of arrival, so that a reader can page on."""

from collections import deque

import msgspec

from scm.v2x.messages.city_event import CityEvent


class LoggedEvent(msgspec.Struct, kw_only=True, frozen=True):
    """An event and its number; numbers start at 1 and have no gaps."""

    seq: int
    severity: str
    source: str
    t_ns: int
    name: str
    text: str
    vehicle: str | None = None


class EventLog:
    """A bounded log: the oldest event is forgotten when it is full."""

    def __init__(self, depth: int = 2000) -> None:
        self._events: deque[LoggedEvent] = deque(maxlen=depth)
        self.newest_seq = 0

    def add(self, event: CityEvent) -> None:
        """Append an event under the next number."""
        self.newest_seq += 1
        facts = {name: getattr(event, name) for name in event.__struct_fields__}
        self._events.append(LoggedEvent(seq=self.newest_seq, **facts))

    def after(self, seq: int, limit: int) -> tuple[LoggedEvent, ...]:
        """Return up to `limit` events numbered above `seq`, oldest first."""
        first = self._events[0].seq if self._events else 1
        start = max(0, seq + 1 - first)
        return tuple(self._events[i] for i in range(start, min(start + limit, len(self._events))))
