"""Long work: what it does and how far it is."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.fields import ErrorText, Id, KindName, OwnerName

State = Literal["waiting", "running", "done", "failed", "cancelled"]


class Operation(msgspec.Struct, kw_only=True, frozen=True):
    """One piece of long work.

    Attributes:
        id: Of this operation, below `/operations`.
        kind: What work it is: `mismatch`, `export`, ...
        what: Of which thing, in words.
        state: How far it is.
        progress: 0 to 1; None: not known.
        doing: The step it is at, in words.
        result: Address of what it made; empty until it is done.
        error: Why it failed; empty unless it did.
        owner: Who requested it.
        asked_ns: When it was requested [ns since 1970].
        began_ns: When it began [ns since 1970].
        ended_ns: When it was over [ns since 1970]; null: it is not.
    """

    id: Id
    kind: KindName
    what: Annotated[str, Meta(examples=["runs/today.mcap, n1"])]
    state: State
    progress: float | None
    doing: Annotated[str, Meta(examples=["reads the recording"])]
    result: Annotated[str, Meta(examples=["/mismatch/today-n1"])]
    error: ErrorText
    owner: OwnerName
    asked_ns: int
    began_ns: int | None
    ended_ns: int | None
