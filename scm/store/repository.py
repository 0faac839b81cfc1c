"""The contract of a store: named tables of small values, and logs that only grow.

Three keep it: `memory.py` inside one process, `sqlite.py`, a file beside the recordings, and
`postgres.py`, a server. The same tests run over all of them. Several processes may use one store;
each transaction of one excludes those of the others. Values are bytes, mostly JSON of a record;
what the records mean stands in `records.py` and with those who own them.
"""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Literal, NamedTuple, Protocol, get_args

Table = Literal[
    "leases",
    "plans",
    "answers",
    "credentials",
    "latches",
    "marks",
    "seen",
    "calibrations",
    "twins",
    "handovers",
]
Log = Literal["audit"]

TABLES: tuple[Table, ...] = get_args(Table)
LOGS: tuple[Log, ...] = get_args(Log)


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

    def last(self, log: Log) -> Entry | None:
        """Return the newest entry; None: there is none."""
        ...

    def transaction(self) -> AbstractContextManager[None]:
        """Let everything inside happen at once, or not at all; inside another one it joins it."""
        ...

    def close(self) -> None:
        """Leave; safe to call twice."""
        ...
