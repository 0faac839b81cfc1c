"""Records of signals_parts.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

import msgspec


class StageBody(msgspec.Struct, kw_only=True, frozen=True):
    """One stage of the cycle; yellow and red clear after it are the kernel's.

    Attributes:
        groups: that are green together
        green_s: how long they are green
        extra_red_s: all red on top of red clear
    """

    groups: tuple[str, ...]
    green_s: float
    extra_red_s: float = 0.0


class GroupRow(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        colour: None while nothing fresh is known.
        next_colour: What comes then; null: not known.
        min_s: It will not change before; None: not known.
        max_s: It will have changed by then; None: not known.
        likely_s: It will likely change then: a forecast, no promise; None: nobody knows.
        likely_confidence: Share of such forecasts that come true within a second, 0 to 1.
        since_ns: When this colour began, on the controller's clock.
    """

    group: str
    colour: str | None
    next_colour: str | None = None
    min_s: float | None = None
    max_s: float | None = None
    likely_s: float | None = None
    likely_confidence: float | None = None
    since_ns: int | None = None


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
        t_ns: The controller's clock now; None: it was never heard.
        fresh: Whether it was heard within the last second.
        mode: What governs it now.
        plan: Name of the signal plan in force.
        plans: Names of the signal plans offered.
        groups: Signal groups.
        monitor: What the second channel says; null: it was not heard.
    """

    junction: str
    t_ns: int | None
    fresh: bool
    mode: str | None
    plan: str | None
    plans: tuple[str, ...]
    groups: tuple[GroupRow, ...]
    monitor: MonitorRow | None


class Signals(msgspec.Struct, kw_only=True, frozen=True):
    """All junctions of the map.

    Attributes:
        signals: One row a junction, in the map's order.
    """

    signals: tuple[JunctionRow, ...]


class SignalPhase(msgspec.Struct, kw_only=True, frozen=True):
    """A phase: one signal group, and the times that the kernel and the rings keep.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        min_green_s: Green lasts at least so long [s].
        yellow_s: Yellow change.
        red_clear_s: Red clear, all red before anybody in conflict may start.
        passage_s: A green gaps out this long after the last vehicle.
        max1_s: A green ends after it once others are called; max 2 holds in queues.
        max2_s: A green ends after it once others are called; max 2 holds in queues.
    """

    group: str
    min_green_s: float
    yellow_s: float
    red_clear_s: float
    passage_s: float
    max1_s: float
    max2_s: float


class SignalStage(msgspec.Struct, kw_only=True, frozen=True):
    """Groups that are green together, for how long, and how much later the next stage begins.

    Groups of the next stage as well stay green between them; all others are red meanwhile.

    Attributes:
        groups: Signal groups.
        green_s: The stage's split without yellow and red clear of those that leave it, which the
            kernel adds.
        extra_red_s: On top of red clear.
    """

    groups: tuple[str, ...]
    green_s: float
    extra_red_s: float = 0.0


class SignalSlot(msgspec.Struct, kw_only=True, frozen=True):
    """A stage of a cycle: green from `start_s` to `end_s` after the cycle's begin.

    Attributes:
        groups: Signal groups.
        start_s: When it begins [s].
        end_s: When it ends [s].
    """

    groups: tuple[str, ...]
    start_s: float
    end_s: float


class SignalPlan(msgspec.Struct, kw_only=True, frozen=True):
    """A fixed-time plan as this junction runs it.

    Attributes:
        plan: Name of the signal plan in force.
        about: What it is for, in a sentence.
        cycle_s: How long its cycle is [s].
        stages: What makes it.
        slots: Its timetable; yellow and red clear lie between two of them, for groups that are not
            in both.
        in_step: Whether it keeps a common cycle with other junctions: a green wave.
        offset_s: When its cycle begins in the common one; None: it keeps none.
    """

    plan: str
    about: str
    cycle_s: float
    stages: tuple[SignalStage, ...]
    slots: tuple[SignalSlot, ...]
    in_step: bool = False
    offset_s: float | None = None


class SignalPolicy(msgspec.Struct, kw_only=True, frozen=True):
    """A policy that may be asked for; `has_detectors`: it listens for cars.

    Attributes:
        policy: Name of the policy in force.
        about: What it is for, in a sentence.
        has_detectors: Whether it listens for cars.
    """

    policy: str
    about: str
    has_detectors: bool


class SignalSite(msgspec.Struct, kw_only=True, frozen=True):
    """One junction for whoever joins; told at the start and every 10 s.

    Attributes:
        junction: Name of a junction.
        t_ns: When it was true, by the clock of who tells it [ns].
        phases: Signal groups with their least times.
        conflicts: Pairs of groups that are never green together.
        rings: `rings[section][ring]` is the sequence of groups between two barriers.
        plans: Names of the signal plans offered.
        policies: Policies that may be asked for.
    """

    junction: str
    t_ns: int
    phases: tuple[SignalPhase, ...]
    conflicts: tuple[tuple[str, str], ...]
    rings: tuple[tuple[tuple[str, ...], ...], ...]
    plans: tuple[SignalPlan, ...]
    policies: tuple[SignalPolicy, ...]


class SignalWish(msgspec.Struct, kw_only=True, frozen=True):
    """A wish that is in force.

    Attributes:
        verb: What is wished.
        groups: Signal groups.
        by: Who wished it.
        reason: Why.
        ends_ns: When it lapses at the latest.
        policy: With the verb `policy`: which one.
    """

    verb: Literal["call", "clear", "force_off", "hold", "omit", "policy", "preempt"]
    groups: tuple[str, ...]
    by: str
    reason: str
    ends_ns: int
    policy: str = ""


class SignalDetector(msgspec.Struct, kw_only=True, frozen=True):
    """What the detectors of a group's lanes see; `queue` counts cars.

    Attributes:
        group: Name of a signal group: heads that always show the same.
        call: Whether a car asks for green.
        queue: Cars that wait.
    """

    group: str
    call: bool
    queue: int


class SignalTurn(msgspec.Struct, kw_only=True, frozen=True):
    """Groups that will likely be green together; `end_ns` None: nobody knows until when.

    Groups of the next turn as well stay green between them.

    Attributes:
        groups: Signal groups.
        start_ns: When it began [ns].
        end_ns: When it ends [ns]; null: not known yet.
    """

    groups: tuple[str, ...]
    start_ns: int
    end_ns: int | None


class StatusRow(msgspec.Struct, kw_only=True, frozen=True):
    """What runs at a junction and who wants what, on its controller's clock.

    Attributes:
        junction: Name of a junction.
        policy: Name of the policy in force.
        plan: Name of the signal plan in force.
        pending: Plan or policy to come at the next safe moment; empty: none.
        wishes: Wishes in force.
        detectors: Of its groups; none: nobody listens for cars now.
        turns: Greens on and to come; none: nobody knows.
        failure: Why a policy was given up for fixed time; empty: none was.
        stages: Of the plan in force, where somebody made it: as it runs, whatever it was edited to
            since. No stages: it is one of the junction's own.
        offset_s: Of the plan in force, where somebody made it: as it runs, whatever it was edited
            to since. No stages: it is one of the junction's own.
    """

    junction: str
    policy: str
    plan: str
    pending: str
    wishes: tuple[SignalWish, ...]
    detectors: tuple[SignalDetector, ...]
    turns: tuple[SignalTurn, ...]
    failure: str
    stages: tuple[SignalStage, ...]
    offset_s: float | None
