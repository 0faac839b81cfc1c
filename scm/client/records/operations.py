"""Records of operations.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class Operation(msgspec.Struct, kw_only=True, frozen=True):
    """One piece of long work.

    Attributes:
        id: Of this operation, below `/operations`.
        kind: What work it is: `mismatch`, `export`, ...
        what: Of which thing, in words.
        state: How far it is.
        progress: 0 to 1; None: nobody can tell.
        doing: The step it is at, in words.
        result: Address of what it made; empty until it is done.
        error: Why it failed; empty unless it did.
        owner: Who asked for it.
        asked_ns: When somebody asked for it [ns since 1970].
        began_ns: When it began [ns since 1970].
        ended_ns: When it was over [ns since 1970]; null: it is not.
    """

    id: str
    kind: str
    what: str
    state: Literal["cancelled", "done", "failed", "running", "waiting"]
    progress: float | None
    doing: str
    result: str
    error: str
    owner: str
    asked_ns: int
    began_ns: int | None
    ended_ns: int | None


class PageOperation(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[Operation, ...]
    next_: str | None = msgspec.field(name="next")
