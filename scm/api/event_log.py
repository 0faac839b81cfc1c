"""The last events of the city, numbered in order of arrival, so that a reader can page on.

A number counts from the start of the server. The permanent name of an event is
its `id`: a restarted server receives the last ones again. One that is received twice, because the
bus reconnected or two requested the same in one tick, is noted once.
"""

import hashlib
from collections import deque
from collections.abc import Iterator

import msgspec

from scm.records.events import LoggedEvent
from scm.v2x.messages.city_event import CityEvent

DEPTH = 5000


class EventFilter(msgspec.Struct, kw_only=True, frozen=True):
    """Which events are wanted; what is left empty lets everything pass.

    Attributes:
        severity, source, name: One or more of each, comma between.
        vehicle: The car it is about.
        text: To be found in the sentence, the name or the source; case does not matter, nor
            whether a name has underscores or, as on pages, spaces.
        since_ns, until_ns: When it happened, both ends included [ns since 1970].
    """

    severity: str = ""
    source: str = ""
    name: str = ""
    vehicle: str = ""
    text: str = ""
    since_ns: int | None = None
    until_ns: int | None = None

    def passes(self, event: LoggedEvent) -> bool:
        """Return whether an event is wanted."""
        return (
            _names(self.severity, event.severity)
            and _names(self.source, event.source)
            and _names(self.name, event.name)
            and self.vehicle in ("", event.vehicle)
            and as_read(self.text) in as_read(f"{event.text} {event.name} {event.source}")
            and (self.since_ns is None or event.t_ns >= self.since_ns)
            and (self.until_ns is None or event.t_ns <= self.until_ns)
        )


def as_read(text: str) -> str:
    """Return a text as it is looked for: in small letters, names in words as on pages."""
    return text.casefold().replace("_", " ")


class EventLog:
    """A bounded log: the oldest event is forgotten when it is full."""

    def __init__(self, depth: int = DEPTH) -> None:
        self._depth = depth
        self._events: deque[LoggedEvent] = deque()
        self._ids: set[str] = set()
        self.newest_seq = 0

    def add(self, event: CityEvent) -> None:
        """Append an event under the next number, unless it is here already."""
        name = id_of(event)
        if name in self._ids:
            return
        self._ids.add(name)
        self.newest_seq += 1
        facts = {name: getattr(event, name) for name in event.__struct_fields__}
        self._events.append(LoggedEvent(seq=self.newest_seq, id=name, **facts))
        if len(self._events) > self._depth:
            self._ids.discard(self._events.popleft().id)

    def after(self, seq: int, limit: int) -> tuple[LoggedEvent, ...]:
        """Return up to `limit` events numbered above `seq`, oldest first."""
        first = self._events[0].seq if self._events else 1
        start = max(0, seq + 1 - first)
        return tuple(self._events[i] for i in range(start, min(start + limit, len(self._events))))

    def newest_first(self) -> Iterator[LoggedEvent]:
        """Return a copy of all stored events."""
        return iter(tuple(reversed(self._events)))


def id_of(event: CityEvent) -> str:
    """Return what an event is called for good: 16 hexadecimal digits."""
    text = f"{event.t_ns}\n{event.source}\n{event.name}\n{event.vehicle}\n{event.text}"
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _names(wanted: str, own: str) -> bool:
    return not wanted or own in (part.strip() for part in wanted.split(","))
