"""A store that dies with its process: for cities in lockstep, and for tests."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from scm.errors import StoreError
from scm.store.repository import LOGS, TABLES, Entry, Log, Table


class MemoryStore:
    """Dictionaries and lists; see `scm.store.repository.Repository`."""

    def __init__(self) -> None:
        self._tables: dict[Table, dict[str, bytes]] = {table: {} for table in TABLES}
        self._logs: dict[Log, list[bytes]] = {log: [] for log in LOGS}
        self._lock = threading.RLock()
        self._depth = 0
        self._closed = False

    def get(self, table: Table, key: str) -> bytes | None:
        """Return a value; None: there is none of that key."""
        with self._open():
            return self._tables[table].get(key)

    def put(self, table: Table, key: str, value: bytes) -> None:
        """Write a value over whatever was there."""
        with self._open():
            self._tables[table][key] = value

    def delete(self, table: Table, key: str) -> None:
        """Take a value away; nothing happens when there is none."""
        with self._open():
            self._tables[table].pop(key, None)

    def items(self, table: Table) -> Iterator[tuple[str, bytes]]:
        """Return all keys with their values, sorted by key."""
        with self._open():
            return iter(sorted(self._tables[table].items()))

    def append(self, log: Log, body: bytes) -> int:
        """Add an entry to a log; return its number."""
        with self._open():
            self._logs[log].append(body)
            return len(self._logs[log])

    def entries(self, log: Log, after: int = 0, limit: int = 500) -> list[Entry]:
        """Return entries after a number, in order."""
        with self._open():
            bodies = self._logs[log][after : after + limit]
            return [Entry(after + i + 1, body) for i, body in enumerate(bodies)]

    def last(self, log: Log) -> Entry | None:
        """Return the newest entry; None: there is none."""
        with self._open():
            bodies = self._logs[log]
            return Entry(len(bodies), bodies[-1]) if bodies else None

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Let everything inside happen at once, or not at all; inside another one it joins it."""
        with self._open():
            before = (
                {table: dict(values) for table, values in self._tables.items()},
                {log: list(bodies) for log, bodies in self._logs.items()},
            )
            self._depth += 1
            try:
                yield
            except BaseException:
                if self._depth == 1:
                    self._tables, self._logs = before
                raise
            finally:
                self._depth -= 1

    def close(self) -> None:
        """Leave; safe to call twice."""
        self._closed = True

    @contextmanager
    def _open(self) -> Iterator[None]:
        with self._lock:
            if self._closed:
                msg = "the store in memory is closed"
                raise StoreError(msg)
            yield
