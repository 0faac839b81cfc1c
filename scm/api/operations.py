"""Long work: an answer at once, 202 with an operation to look at, and the work on a thread.

An operation is `waiting`, `running`, then `done`, `failed` or `cancelled` for good. Work of one
kind runs one at a time, in the order of requests.
"""

import itertools
import logging
import re
import threading
from collections import OrderedDict, deque
from collections.abc import Callable

import msgspec
from fastapi import Response

from scm.api.city import json_response
from scm.api.problem import RefusedError
from scm.clock import Clock
from scm.errors import ScmError
from scm.records.operations import Operation, State

_LOGGER = logging.getLogger(__name__)

MAX_OPERATIONS = 200
MOST_WAITING = 20

# A quoted path may hold spaces. `km/h` and `http://host/x` are no paths, `/api/...` is an address.
_PATH = re.compile(
    r"""(?<=')/(?!api/)(?:[^/'\n]+/)*(?P<quoted>[^/'\n]*)(?=')"""
    r"""|(?<![\w/.:~-])/(?!api/)(?:[^\s/'",;:()]+/)+(?P<plain>[^\s/'",;:()]*)"""
)


class Cancelled(Exception):  # noqa: N818  it is no error
    """Raised inside work that was called off, at its next word about itself."""


class ProgressReporter:
    """Reports the progress of work; raises `Cancelled` when it was cancelled."""

    def __init__(self, operations: "Operations", name: str, cancel: threading.Event) -> None:
        self._operations = operations
        self._name = name
        self.cancelled = cancel

    def __call__(self, doing: str = "", progress: float | None = None) -> None:
        """Report the step and the share of work done."""
        self.check()
        changes = {"doing": doing, "progress": progress}
        self._operations.change(self._name, **changes)

    def check(self) -> None:
        """Raise `Cancelled` when the work was cancelled; report nothing."""
        if self.cancelled.is_set():
            raise Cancelled


Work = Callable[[ProgressReporter], str]
"""Does the work; returns the address of what it made."""


class Operations:
    """All long work of one server; safe from any thread. What is long over is forgotten."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = threading.RLock()
        self._moved = threading.Condition(self._lock)
        self._numbers = itertools.count(1)
        self._rows: OrderedDict[str, Operation] = OrderedDict()
        self._cancels: dict[str, threading.Event] = {}
        self._queues: dict[str, deque[str]] = {}

    def start(self, kind: str, what: str, work: Work, *, owner: str = "") -> Operation:
        """Begin work on a thread of its own, or let it wait for the one of its kind that runs.

        Raises:
            RefusedError: when too many of its kind wait already.
        """
        with self._lock:
            waiting = sum(
                row.kind == kind and row.state in ("waiting", "running")
                for row in self._rows.values()
            )
            if waiting >= MOST_WAITING:
                detail = f"operations of kind {kind!r}: {waiting} wait, expected fewer; try later"
                raise RefusedError.of("busy", detail)
            row = Operation(
                id=f"{kind}-{next(self._numbers)}",
                kind=kind,
                what=what,
                state="waiting",
                progress=None,
                doing="waits for its turn",
                result="",
                error="",
                owner=owner,
                asked_ns=self._clock.now_ns(),
                began_ns=None,
                ended_ns=None,
            )
            self._rows[row.id] = row
            self._cancels[row.id] = threading.Event()
            queue = self._queues.setdefault(kind, deque())
            queue.append(row.id)
            self._forget()
        thread = threading.Thread(
            target=self._run, args=(row.id, work, queue), name=row.id, daemon=True
        )
        thread.start()
        return row

    def rows(self) -> tuple[Operation, ...]:
        """Return all that is known, newest first."""
        with self._lock:
            return tuple(reversed(self._rows.values()))

    def find(self, name: str) -> Operation | None:
        """Return an operation by its id; None: not known, or forgotten."""
        with self._lock:
            return self._rows.get(name)

    def cancel(self, name: str) -> Operation | None:
        """Call work off: what waits ends at once, what runs at its next word about itself."""
        with self._moved:
            cancel = self._cancels.get(name)
            if cancel is not None:
                cancel.set()
                self._moved.notify_all()
        return self.find(name)

    def change(self, name: str, **changes: object) -> None:
        """Change what is published of an operation; paths on the server are not published."""
        for text in ("doing", "error"):
            if text in changes:
                changes[text] = without_paths(str(changes[text]))
        with self._lock:
            row = self._rows.get(name)
            if row is not None:
                self._rows[name] = msgspec.structs.replace(row, **changes)

    def close(self) -> None:
        """Call all work off, without waiting for it."""
        with self._moved:
            for cancel in self._cancels.values():
                cancel.set()
            self._moved.notify_all()

    def _run(self, name: str, work: Work, queue: deque[str]) -> None:
        progress = ProgressReporter(self, name, self._cancels[name])
        with self._moved:
            self._moved.wait_for(lambda: queue[0] == name or progress.cancelled.is_set())
        try:
            self._work(name, work, progress)
        finally:
            with self._moved:
                queue.remove(name)
                self._moved.notify_all()

    def _work(self, name: str, work: Work, progress: ProgressReporter) -> None:
        try:
            progress.check()
            self.change(name, state="running", began_ns=self._clock.now_ns())
            progress("begins")
            result = work(progress)
        except Cancelled:
            self._end(name, "cancelled")
        except ScmError as error:
            self._end(name, "failed", error=str(error))
        except Exception:
            _LOGGER.exception("operation_failed id=%s", name)
            self._end(name, "failed", error="the server failed on this; its log has the reason")
        else:
            self._end(name, "done", result=result, progress=1.0)

    def _end(self, name: str, state: State, **changes: object) -> None:
        over = {"state": state, "doing": "", "ended_ns": self._clock.now_ns()}
        self.change(name, **over, **changes)

    def _forget(self) -> None:
        for name in [name for name, row in self._rows.items() if row.ended_ns is not None]:
            if len(self._rows) <= MAX_OPERATIONS:
                return
            del self._rows[name]
            del self._cancels[name]


def without_paths(text: str) -> str:
    """Return a text whose absolute paths are the names of their files alone, but for our addresses.

    Readers of a job need not know the names of the server's folders: its log has them.
    """
    return _PATH.sub(lambda match: match["quoted"] or match["plain"] or "a folder", text)


def accepted(row: Operation) -> Response:
    """Return 202 with the operation and its address."""
    return json_response(row, 202, {"Location": f"/api/v1/operations/{row.id}"})
