"""Long work: what it does and how far it is."""

from typing import Literal

import msgspec

State = Literal["waiting", "running", "done", "failed", "cancelled"]


class Operation(msgspec.Struct, kw_only=True, frozen=True):
    """One piece of long work.

    Attributes:
        id: Of this operation, below `/operations`.
        kind: What work it is: `mismatch`, `export`, ...
        what: Of which thing, in words.
        progress: 0 to 1; None: not known.
        doing: The step it is at, in words.
        result: Address of what it made; empty until it is done.
        error: Why it failed; empty unless it did.
        owner: Who requested it.
    """

    id: str
    kind: str
    what: str
    state: State
    progress: float | None
    doing: str
    result: str
    error: str
    owner: str
    asked_ns: int
    began_ns: int | None
    ended_ns: int | None
