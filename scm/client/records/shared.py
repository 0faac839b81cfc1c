"""Records of shared.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class StationRow(msgspec.Struct, kw_only=True, frozen=True):
    """One run of one station.

    Attributes:
        role: What it is in the city, or what its holder may do.
        name: What it is called.
        session: Of this run of it: another after each start.
        alive: Whether it is there; false: it left or died.
        since_ns: When it was first seen here.
        lost_ns: When it left or died; None while it is there.
        age_s: Since its last status; None: it never sent one.
        detail: What it says of itself, or what was seen, in words.
        step_ms: Its slowest step of the last second [ms].
        late_steps: Steps that began later than a period after they were due.
        dropped: Messages that its mailboxes had to drop, since its start.
    """

    role: str
    name: str
    session: str
    alive: bool
    since_ns: int
    lost_ns: int | None = None
    age_s: float | None = None
    detail: str = ""
    step_ms: float = 0.0
    late_steps: int = 0
    dropped: int = 0


class Residual(msgspec.Struct, kw_only=True, frozen=True):
    """Measured minus true: distance on the floor, and yaw (+ = measured further left).

    Attributes:
        position_mm: Distance from the truth, on the floor [mm].
        yaw_deg: Measured further left than the truth [degree].
    """

    position_mm: float
    yaw_deg: float


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
