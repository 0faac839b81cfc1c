"""Records of signals.

Written by docs/make/client.py: do not change it here.
"""

import msgspec


class GroupRow(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        colour: None while nothing fresh is known.
        next_colour: What comes then; null: not known.
        min_s: It will not change before; None: not known.
        max_s: It will have changed by then; None: not known.
    """

    group: str
    colour: str | None
    next_colour: str | None = None
    min_s: float | None = None
    max_s: float | None = None


class MonitorRow(msgspec.Struct, kw_only=True, frozen=True):
    """The second channel; `fault` is None while all is well, `age_s` since it was last heard.

    Attributes:
        fault: What the monitor latched; null: all is well.
        detail: What it says of itself, or what was seen, in words.
        age_s: How long ago it was heard last [s].
    """

    fault: str | None
    detail: str
    age_s: float


class JunctionRow(msgspec.Struct, kw_only=True, frozen=True):
    """One junction; `fresh` tells whether its controller was heard within the last second.

    Attributes:
        junction: Name of a junction.
        fresh: Whether it was heard within the last second.
        mode: What governs it now.
        plan: Name of the signal plan in force.
        plans: Names of the signal plans offered.
        groups: Signal groups.
        monitor: The second channel; `fault` is None while all is well, `age_s` since it was last
            heard.
    """

    junction: str
    fresh: bool
    mode: str | None
    plan: str | None
    plans: tuple[str, ...]
    groups: tuple[GroupRow, ...]
    monitor: MonitorRow | None


class Junctions(msgspec.Struct, kw_only=True, frozen=True):
    """All junctions of the map, in its order.

    Attributes:
        signals: One row a junction.
    """

    signals: tuple[JunctionRow, ...]


class PlanReply(msgspec.Struct, kw_only=True, frozen=True):
    """The wish was taken.

    Attributes:
        junction: Name of a junction.
        plan: In force now.
        pending: To come into force at the next safe moment; empty: none.
    """

    junction: str
    plan: str
    pending: str = ""


class MonitorStatus(msgspec.Struct, kw_only=True, frozen=True):
    """The monitor's verdict, repeated at 2 Hz and at once on change.

    Attributes:
        junction: Name of a junction.
        t_ns: When it was true, by the clock of who tells it [ns].
        fault: None while all is well; else `conflict`, `dark`, `short_yellow`, `short_clearance`,
            `short_green`, `skipped_yellow`, `stale`, `clock_jump`.
        detail: What was seen, in words.
        since_ns: Of the fault, or of the last reset.
    """

    junction: str
    t_ns: int
    fault: str | None
    detail: str = ""
    since_ns: int
