"""Write-ahead storage: a step's state is stored in one transaction before its answers are sent.

`DirectWriter` writes at once. `BackgroundWriter` writes on a thread, so that a slow disk or an
unreachable server never delays a part's next step: only the answers wait. A failed write is retried
until it succeeds; meanwhile `stuck` gives the reason.
"""

import logging
import queue
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import msgspec

from scm.errors import StoreError
from scm.log import event
from scm.store.audit import AuditLog, Deed
from scm.store.repository import Repository, Table
from scm.v2x.answers import StoredAnswer
from scm.v2x.exchange import Answer, Call

RETRY_S = 0.5
CLOSE_S = 2.0

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """What one step stores.

    Attributes:
        values: Table, key and value; None deletes it.
        deeds: For the audit log.
        answers: To be sent when all of it is stored.
        calls: Likewise.
    """

    values: Sequence[tuple[Table, str, bytes | None]]
    deeds: Sequence[Deed]
    answers: Sequence[Answer]
    calls: Sequence[Call] = ()


class BatchStore(Protocol):
    """Stores batches in order, each in one transaction."""

    def stored_answers(self) -> dict[str, StoredAnswer]:
        """Return the answers of earlier runs, by key."""
        ...

    def write(self, batch: Batch) -> None:
        """Store a batch, now or soon."""
        ...

    def written(self) -> list[Batch]:
        """Return the newly stored batches, in order."""
        ...

    @property
    def stuck(self) -> str:
        """Why nothing can be stored now; empty: storing works."""
        ...

    def close(self) -> None:
        """Try for a moment to store waiting batches; the store itself stays open."""
        ...


class _Writer:
    """Writes batches of one run of one station, each exactly once.

    The connection to a server may break during a commit. A mark written with the batches shows at
    the next attempt whether they were stored, so that the audit log has no second copy.
    """

    def __init__(self, store: Repository, station: str, session: str) -> None:
        self._store = store
        self._station = station
        self._session = session
        self._number = 0
        self._commit_unknown = False
        self.stuck = ""

    def stored_answers(self) -> dict[str, StoredAnswer]:
        prefix = f"{self._station}/"
        return {
            key.removeprefix(prefix): msgspec.json.decode(value, type=StoredAnswer)
            for key, value in self._store.items("answers")
            if key.startswith(prefix)
        }

    def commit(self, batches: Sequence[Batch]) -> bool:
        try:
            self._write(batches)
        except StoreError as cause:
            self._commit_unknown = True
            if not self.stuck:
                facts = {"station": self._station, "reason": cause}
                event(_log, "state_not_stored", level=logging.ERROR, **facts)
            self.stuck = f"{self._station} cannot store its state now: {cause}"
            return False
        if self.stuck:
            event(_log, "state_stored_again", station=self._station)
        self._number += 1
        self._commit_unknown, self.stuck = False, ""
        return True

    def _write(self, batches: Sequence[Batch]) -> None:
        store, log = self._store, AuditLog(self._store)
        mark = f"{self._session} {self._number}".encode()
        with store.transaction():
            if self._commit_unknown and store.get("marks", self._station) == mark:
                return
            for batch in batches:
                for table, key, value in batch.values:
                    name = f"{self._station}/{key}"
                    if value is None:
                        store.delete(table, name)
                    else:
                        store.put(table, name, value)
                for deed in batch.deeds:
                    log.note(deed)
            store.put("marks", self._station, mark)


class DirectWriter:
    """Stores at once, in the caller's step; see `BatchStore`."""

    def __init__(self, store: Repository, station: str, session: str) -> None:
        self._writer = _Writer(store, station, session)
        self._waiting: list[Batch] = []
        self._under_way: list[Batch] = []
        self._safe: list[Batch] = []

    def stored_answers(self) -> dict[str, StoredAnswer]:
        """Return the answers of earlier runs, by key."""
        return self._writer.stored_answers()

    def write(self, batch: Batch) -> None:
        """Store a batch."""
        self._waiting.append(batch)

    def written(self) -> list[Batch]:
        """Return the newly stored batches, in order."""
        while self._under_way or self._waiting:
            if not self._under_way:
                self._under_way, self._waiting = self._waiting, []
            if not self._writer.commit(self._under_way):
                return []
            self._safe += self._under_way
            self._under_way = []
        safe, self._safe = self._safe, []
        return safe

    @property
    def stuck(self) -> str:
        """Why nothing can be stored now; empty: storing works."""
        return self._writer.stuck

    def close(self) -> None:
        """Nothing waits here longer than a step."""


class BackgroundWriter:
    """Stores on a thread of its own, everything that waits in one transaction; see `BatchStore`."""

    def __init__(self, store: Repository, station: str, session: str) -> None:
        self._writer = _Writer(store, station, session)
        self._waiting: queue.SimpleQueue[Batch | None] = queue.SimpleQueue()
        self._safe: queue.SimpleQueue[Batch] = queue.SimpleQueue()
        self._ending = threading.Event()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"keep {station}", daemon=True)
        self._thread.start()

    def stored_answers(self) -> dict[str, StoredAnswer]:
        """Return the answers of earlier runs, by key."""
        return self._writer.stored_answers()

    def write(self, batch: Batch) -> None:
        """Have a batch stored soon."""
        self._waiting.put(batch)

    def written(self) -> list[Batch]:
        """Return the newly stored batches, in order."""
        if self._failure is not None:
            raise self._failure
        safe: list[Batch] = []
        while not self._safe.empty():
            safe.append(self._safe.get())
        return safe

    @property
    def stuck(self) -> str:
        """Why nothing can be stored now; empty: storing works."""
        return self._writer.stuck

    def close(self) -> None:
        """Try for a moment to store what waits."""
        self._waiting.put(None)
        self._thread.join(CLOSE_S)
        self._ending.set()

    def _run(self) -> None:
        try:
            while (batches := self._next_batches()) is not None:
                while not self._writer.commit(batches):
                    if self._ending.wait(RETRY_S):
                        return
                for batch in batches:
                    self._safe.put(batch)
        except Exception as failure:  # noqa: BLE001  the edge of a thread: the part must receive it
            self._failure = failure

    def _next_batches(self) -> list[Batch] | None:
        """Wait for a batch; return all that wait then, or None at the end."""
        first = self._waiting.get()
        if first is None:
            return None
        batches = [first]
        while not self._waiting.empty():
            more = self._waiting.get()
            if more is None:
                self._waiting.put(None)
                break
            batches.append(more)
        return batches
