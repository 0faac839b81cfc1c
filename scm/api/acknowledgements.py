"""Acknowledgements: a person has seen an event, which everybody then sees.

They are stored in the city's state, so that they outlive the server; the oldest are dropped.
"""

import threading
from collections.abc import Sequence

import msgspec

from scm.clock import Clock
from scm.errors import StoreError
from scm.records.events import Acknowledgement
from scm.store.repository import Repository

MAX_ACKNOWLEDGEMENTS = 5000
_PREFIX = "event/"


class Acknowledgements:
    """All acknowledgements of a city; safe from any thread.

    Who looks never waits for the store: the live stream does so in the loop that serves all pages.
    """

    def __init__(self, store: Repository, clock: Clock) -> None:
        self._store = store
        self._clock = clock
        self._changing = threading.Lock()
        stored = [_read(key, body) for key, body in store.items("seen") if key.startswith(_PREFIX)]
        stored.sort(key=lambda row: row.at_ns)
        self._rows = {row.event: row for row in stored}  # replaced by a change, never changed

    def rows(self) -> dict[str, Acknowledgement]:
        """Return all of them by the event's id."""
        return dict(self._rows)

    def newest(self, most: int) -> tuple[Acknowledgement, ...]:
        """Return those that came last, oldest first."""
        return tuple(self._rows.values())[-most:]

    def add(self, events: Sequence[str], by: str, note: str = "") -> tuple[Acknowledgement, ...]:
        """Acknowledge events by their ids; one already acknowledged stays as it was."""
        with self._changing:
            now_ns = self._clock.now_ns()
            fresh = {
                event: Acknowledgement(event=event, by=by, note=note, at_ns=now_ns)
                for event in events
                if event not in self._rows
            }
            rows = self._rows | fresh
            gone = tuple(rows)[: max(0, len(rows) - MAX_ACKNOWLEDGEMENTS)]
            with self._store.transaction():
                for event, row in fresh.items():
                    self._store.put("seen", _PREFIX + event, msgspec.json.encode(row))
                for event in gone:
                    self._store.delete("seen", _PREFIX + event)
            for event in gone:
                del rows[event]
            self._rows = rows  # what is not stored was not done
            return tuple(rows[event] for event in events if event in rows)

    def withdraw(self, event: str) -> Acknowledgement | None:
        """Take one back; return what it was, or None."""
        with self._changing:
            row = self._rows.get(event)
            if row is not None:
                self._store.delete("seen", _PREFIX + event)
                self._rows = {name: one for name, one in self._rows.items() if name != event}
            return row


def _read(key: str, body: bytes) -> Acknowledgement:
    try:
        return msgspec.json.decode(body, type=Acknowledgement)
    except msgspec.MsgspecError as cause:
        msg = f"state: seen {key}: {cause}; expected an acknowledgement"
        raise StoreError(msg) from cause
