"""Long work of the city: waiting for an operation until it is over."""

import threading
from collections.abc import Callable
from time import monotonic

from scm.client.connection import Connection, part
from scm.errors import LinkError, ScmError
from scm.records.operations import Operation

LOOK_S = 0.25


class WorkError(ScmError):
    """It failed, or was cancelled; `work` is its last known state."""

    def __init__(self, work: Operation) -> None:
        super().__init__(f"{work.kind} of {work.what}: {work.state}: {work.error}".rstrip(": "))
        self.work = work


def finished(
    connection: Connection,
    work: Operation,
    on_progress: Callable[[Operation], object] | None,
    timeout_s: float,
) -> Operation:
    """Return work once it is done.

    Args:
        connection: To its city.
        work: As it was begun.
        on_progress: Receives every step.
        timeout_s: How long to wait.

    Raises:
        WorkError: when it fails or is called off.
        LinkError: when it takes longer than that; it continues.
    """
    path, until_s = f"/api/v1/operations/{part(work.id)}", monotonic() + timeout_s
    while work.state in ("waiting", "running"):
        if monotonic() > until_s:
            msg = f"{work.kind} of {work.what}: not over after {timeout_s:g} s: {work.doing}"
            raise LinkError(msg)
        threading.Event().wait(LOOK_S)
        before, work = work, connection.request("GET", path, Operation)
        if on_progress is not None and (work.doing, work.progress) != (
            before.doing,
            before.progress,
        ):
            on_progress(work)
    if work.state != "done":
        raise WorkError(work)
    return work
