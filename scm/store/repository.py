"""The contract of a store: named tables of small values, and logs that only grow.

Two keep it: `sqlite.py`, a file beside the recordings, and `postgres.py`, a server. The same tests
run over both. A store is used by one process at a time for writing; values are bytes, mostly JSON
of a message or a record, and the typed views of them stand with those who own them.
"""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Literal, NamedTuple, Protocol

Table = Literal["leases", "plans", "answers", "credentials"]
Log = Literal["audit"]


class Entry(NamedTuple):
    """One entry of a log; `number` counts from 1 and never has gaps."""

    number: int
    body: bytes


class Repository(Protocol):
    """What every store offers; a StoreError says what could not be read or written, and where."""

    def get(self, table: Table, key: str) -> bytes | None:
        """Return a value; None: there is none of that key."""
        ...

    def put(self, table: Table, key: str, value: bytes) -> None:
        """Write a value over whatever was there."""
        ...

    def delete(self, table: Table, key: str) -> None:
        """Take a value away; nothing happens when there is none."""
        ...

    def items(self, table: Table) -> Iterator[tuple[str, bytes]]:
        """Return all keys with their values, sorted by key."""
        ...

    def append(self, log: Log, body: bytes) -> int:
        """Add an entry to a log; return its number."""
        ...

    def entries(self, log: Log, after: int = 0, limit: int = 500) -> list[Entry]:
        """Return entries after a number, in order."""
        ...

    def transaction(self) -> AbstractContextManager[None]:
        """Let everything inside happen at once, or not at all."""
        ...

    def close(self) -> None:
        """Leave; safe to call twice."""
        ...
