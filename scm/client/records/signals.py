"""Records of signals.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec

from scm.client.records.signals_parts import SignalStage, SignalWish


class Bar(msgspec.Struct, kw_only=True, frozen=True):
    """One colour of one group; `end_ns` None: it is shown still.

    Attributes:
        colour: Colour.
        start_ns: When it began [ns].
        end_ns: When it ends [ns]; null: not known yet.
    """

    colour: str
    start_ns: int
    end_ns: int | None


class GroupBars(msgspec.Struct, kw_only=True, frozen=True):
    """What one group showed, oldest first.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        bars: What was shown, oldest first.
    """

    group: str
    bars: tuple[Bar, ...]


class Running(msgspec.Struct, kw_only=True, frozen=True):
    """What ran from a time on.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        mode: What governs it now.
        plan: Name of the signal plan in force.
    """

    t_ns: int
    mode: str
    plan: str


class History(msgspec.Struct, kw_only=True, frozen=True):
    """The last minutes of one junction, on its controller's clock.

    Attributes:
        junction: Name of a junction.
        t_ns: Of the last step that was heard; None: none was yet.
        kept_s: How far back anything is kept.
        groups: Signal groups.
        ran: What ran, oldest first.
    """

    junction: str
    t_ns: int | None
    kept_s: int
    groups: tuple[GroupBars, ...]
    ran: tuple[Running, ...]


class LeadScore(msgspec.Struct, kw_only=True, frozen=True):
    """Likely ends as told some time before the end, against the end.

    Attributes:
        colour: That ended.
        lead_s: How long before.
        errors_s: Told less true, one for each colour that ended; + = it ended earlier than told.
        unknown: How often no likely end was told.
        mean_s: Of the errors; None: there are none. `worst_s` by its amount.
        worst_s: Of the errors; None: there are none. `worst_s` by its amount.
        within: Share of errors of a second at most.
        told: Mean of the confidence that was told.
    """

    colour: str
    lead_s: int
    errors_s: tuple[float, ...]
    unknown: int
    mean_s: float | None
    worst_s: float | None
    within: float | None
    told: float | None


class PromiseScore(msgspec.Struct, kw_only=True, frozen=True):
    """What became of what SPaT told in the last minutes.

    Attributes:
        junction: Name of a junction.
        kept_s: How far back anything is kept [s].
        judged: Colours that ended.
        early: Of them, before the earliest end that was told.
        late: After the latest end that was told.
        open_: Whose latest end was never told.
        cut: Ended by flash; not judged.
        leads: By how long before.
    """

    junction: str
    kept_s: int
    judged: int
    early: int
    late: int
    open_: int = msgspec.field(name="open")
    cut: int
    leads: tuple[LeadScore, ...]


class PageSignalWish(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[SignalWish, ...]
    next_: str | None = msgspec.field(name="next")


class SignalReply(msgspec.Struct, kw_only=True, frozen=True):
    """The wish was taken; what is in force now, and what is to come at the next safe moment.

    Attributes:
        junction: Name of a junction.
        policy: In force now.
        pending: The policy to come into force; empty: none.
        wishes: Wishes in force.
    """

    junction: str
    policy: str
    pending: str = ""
    wishes: tuple[SignalWish, ...] = ()


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


class FlashReply(msgspec.Struct, kw_only=True, frozen=True):
    """What runs now: a `SignalReply` where the wish has an end of its own, else a `PlanReply`.

    Attributes:
        junction: Name of a junction.
        pending: To come into force at the next safe moment; empty: none.
        policy: In force now; not told by a `PlanReply`.
        plan: In force now; not told by a `SignalReply`.
        wishes: In force now; not told by a `PlanReply`.
    """

    junction: str
    pending: str
    policy: str | None = None
    plan: str | None = None
    wishes: tuple[SignalWish, ...] = ()


class Verdict(msgspec.Struct, kw_only=True, frozen=True):
    """What the monitor said from a time on, on its clock.

    Attributes:
        t_ns: When it was true, by the clock of who tells it [ns].
        fault: What the monitor latched; null: all is well.
        detail: What it says of itself, or what was seen, in words.
    """

    t_ns: int
    fault: str | None
    detail: str


class PageVerdict(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[Verdict, ...]
    next_: str | None = msgspec.field(name="next")


class MonitorStatus(msgspec.Struct, kw_only=True, frozen=True):
    """The monitor's verdict, repeated at 2 Hz and at once on change.

    Attributes:
        junction: Name of a junction.
        t_ns: When it was true, by the clock of who tells it [ns].
        fault: None while all is well; else `conflict`, `dark`, `short_yellow`, `short_clearance`,
            `short_green`, `skipped_yellow`, `stale`, `clock_jump`; or `overload`, which ends by
            itself.
        detail: What was seen, in words.
        since_ns: Of the fault, or of the last reset.
    """

    junction: str
    t_ns: int
    fault: str | None
    detail: str = ""
    since_ns: int


class PlanProof(msgspec.Struct, kw_only=True, frozen=True):
    """What the search walked through without finding fault.

    Attributes:
        digest: Of what was proven.
        states: Of the kernel, under any wishes.
        transitions: Of the kernel, under any wishes.
        plan_states: Of the kernel under this plan, however late its steps.
        plan_transitions: Of the kernel under this plan, however late its steps.
        cycle_s: What the stages make, with yellow and red clear.
        took_s: How long the search took.
    """

    digest: str
    states: int
    transitions: int
    plan_states: int
    plan_transitions: int
    cycle_s: float
    took_s: float


class PlanRow(msgspec.Struct, kw_only=True, frozen=True):
    """A plan as it may be asked for.

    Attributes:
        junction: Name of a junction.
        plan: Name of the signal plan in force.
        about: What it is for, in a sentence.
        source: `shipped` with the city or its map, or `saved` by somebody.
        usable: Whether it is proven for the junction as it is now.
        cycle_s: How long its cycle is [s].
        stages: Its stages, in the order of the cycle.
        offset_s: When its cycle begins, after a time that is a whole number of cycles on the
            controller's clock; null: in step with nobody.
        by: Who wished it.
        reason: Why.
        saved_ns: When it was saved; 0: it was not.
        proof: What the search found of it; null: nobody searched.
    """

    junction: str
    plan: str
    about: str
    source: Literal["saved", "shipped"]
    usable: bool
    cycle_s: float
    stages: tuple[SignalStage, ...]
    offset_s: float | None = None
    by: str = ""
    reason: str = ""
    saved_ns: int = 0
    proof: PlanProof | None = None


class PagePlanRow(msgspec.Struct, kw_only=True, frozen=True):
    """Some rows of a list.

    Attributes:
        items: The rows of this page.
        next_: Cursor of those after them; null at the end.
    """

    items: tuple[PlanRow, ...]
    next_: str | None = msgspec.field(name="next")
