"""Signals of junctions: colours, overrides, detectors."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body, By, Reason
from scm.records.fields import (
    AgeS,
    ColourName,
    Detail,
    EndNs,
    FaultName,
    GroupName,
    GroupNames,
    JunctionName,
    ModeName,
    PendingName,
    PlanName,
    PolicyName,
    ReasonText,
    RequestedBy,
    StartNs,
    TNs,
)
from scm.records.signal_plans import SignalStage

LONGEST_S = 900.0  # that an override may last
ExpiresS = Annotated[
    float,
    Meta(gt=0.0, le=LONGEST_S, description="seconds until it lapses by itself", examples=[60.0]),
]

Verb = Literal["call", "hold", "force_off", "omit", "preempt", "policy", "clear"]


Colour = Literal["red", "green", "yellow", "flashing_red", "dark"]


class SignalOverride(msgspec.Struct, kw_only=True, frozen=True):
    """An override in force.

    Attributes:
        verb: What is requested.
        ends_ns: When it lapses at the latest.
        policy: With the verb `policy`: which one.
    """

    verb: Verb
    groups: GroupNames
    by: RequestedBy
    reason: ReasonText
    ends_ns: int
    policy: PolicyName = ""


class SignalTurn(msgspec.Struct, kw_only=True, frozen=True):
    """Groups that will likely be green together; `end_ns` None: unknown until when.

    Groups of the next turn as well stay green between them.
    """

    groups: GroupNames
    start_ns: StartNs
    end_ns: EndNs | None


class SignalDetector(msgspec.Struct, kw_only=True, frozen=True):
    """What the detectors of a group's lanes see; `queue` counts cars.

    Attributes:
        call: Whether a car requests green.
        queue: Cars that wait.
    """

    group: GroupName
    call: bool
    queue: int


class SignalGroup(msgspec.Struct, kw_only=True, frozen=True):
    """One group of heads that always show the same.

    Attributes:
        colour: Colour.
        since_ns: Since when [ns].
        min_end_ns: The colour will not change before; never moves earlier.
        max_end_ns: It will have changed by then, never moves later; None: not known.
        next_colour: What comes then; None: not known.
        likely_end_ns: A forecast between the two, no guarantee: it moves as cars come. None: not
            known.
        likely_confidence: The share of such forecasts that come true within a second, 0 to 1.
    """

    group: GroupName
    colour: Colour
    since_ns: int
    min_end_ns: int
    max_end_ns: int | None = None
    next_colour: Colour | None = None
    likely_end_ns: int | None = None
    likely_confidence: float | None = None


class GroupRow(msgspec.Struct, kw_only=True, frozen=True):
    """One signal group.

    Attributes:
        colour: None while nothing fresh is known.
        min_s: It will not change before; None: not known.
        max_s: It will have changed by then; None: not known.
        likely_s: It will likely change then: a forecast, no guarantee; None: unknown.
        likely_confidence: Share of such forecasts that come true within a second, 0 to 1.
        since_ns: When this colour began, on the controller's clock.
    """

    group: GroupName
    colour: ColourName | None
    next_colour: (
        Annotated[str, Meta(description="What comes then; null: not known.", examples=["yellow"])]
        | None
    ) = None
    min_s: float | None = None
    max_s: float | None = None
    likely_s: float | None = None
    likely_confidence: float | None = None
    since_ns: int | None = None


class MonitorRow(msgspec.Struct, kw_only=True, frozen=True):
    """The second channel; `fault` is None while all is well, `age_s` since its last message."""

    fault: FaultName | None
    detail: Detail
    age_s: AgeS


class JunctionRow(msgspec.Struct, kw_only=True, frozen=True):
    """One junction; `fresh`: its controller was received within the last second.

    Attributes:
        t_ns: The controller's clock now; None: never received.
        fresh: Whether it was received within the last second.
        groups: Signal groups.
        monitor: Status of the second channel; null: not received.
    """

    junction: JunctionName
    t_ns: TNs | None
    fresh: bool
    mode: ModeName | None
    plan: PlanName | None
    plans: Annotated[
        tuple[str, ...],
        Meta(
            description="Names of the signal plans offered.", examples=[["busy", "calm", "flash"]]
        ),
    ]
    groups: tuple[GroupRow, ...]
    monitor: MonitorRow | None


class StatusRow(msgspec.Struct, kw_only=True, frozen=True):
    """What runs at a junction and who wants what, on its controller's clock.

    Attributes:
        pending: Plan or policy to come at the next safe moment; empty: none.
        wishes: Overrides in force.
        detectors: Of its groups; none: detectors are off.
        turns: Greens on and to come; none: unknown.
        failure: Why a policy was given up for fixed time; empty: none was.
        stages, offset_s: Of the plan in force, where somebody made it: as it runs, whatever it was
            edited to since. No stages: it is one of the junction's own.
    """

    junction: JunctionName
    policy: PolicyName
    plan: PlanName
    pending: PendingName
    wishes: tuple[SignalOverride, ...]
    detectors: tuple[SignalDetector, ...]
    turns: tuple[SignalTurn, ...]
    failure: Annotated[str, Meta(examples=["the policy did not answer"])]
    stages: tuple[SignalStage, ...]
    offset_s: float | None


class FlashReply(msgspec.Struct, kw_only=True, frozen=True):
    """What runs now: a `SignalReply` where the override has an end of its own, else a `PlanReply`.

    Attributes:
        policy: In force now; absent from a `PlanReply`.
        plan: In force now; absent from a `SignalReply`.
        pending: To come into force at the next safe moment; empty: none.
        wishes: In force now; absent from a `PlanReply`.
    """

    junction: JunctionName
    pending: PendingName
    policy: PolicyName | None = None
    plan: PlanName | None = None
    wishes: tuple[SignalOverride, ...] = ()


class Signals(msgspec.Struct, kw_only=True, frozen=True):
    """All junctions of the map.

    Attributes:
        signals: One row a junction, in the map's order.
    """

    signals: tuple[JunctionRow, ...]


class Attributed(Body, kw_only=True, frozen=True):
    """Base of what the log attributes to somebody."""

    by: By = ""
    reason: Reason = ""


class PlanChoiceBody(Attributed, kw_only=True, frozen=True):
    """What to run until further notice; the signal kernel decides when it is safe to begin."""

    plan: Annotated[
        str,
        Meta(
            min_length=1,
            max_length=64,
            description=("a plan by name (shipped, the map's own, or saved), a policy, or `flash`"),
            examples=["calm"],
        ),
    ]


class OverrideBody(Attributed, kw_only=True, frozen=True):
    """An override of signal groups; it ends by itself, and the junction goes back to what runs."""

    groups: Annotated[
        tuple[Annotated[str, Meta(max_length=64)], ...],
        Meta(min_length=1, max_length=64, description="signal groups", examples=[["south_east"]]),
    ]
    expires_s: ExpiresS = 60.0


class PolicyBody(Attributed, kw_only=True, frozen=True):
    """A policy for a while."""

    policy: Annotated[
        str, Meta(min_length=1, max_length=64, description="its name", examples=["actuated"])
    ]
    expires_s: ExpiresS = 300.0


class FlashBody(Attributed, kw_only=True, frozen=True):
    """Flashing red, at once."""

    engaged: Annotated[
        bool, Meta(description="true: flash; false: resume, all red first", examples=[True])
    ]
    expires_s: Annotated[
        ExpiresS | None,
        Meta(description="seconds until it ends by itself; null: not by itself", examples=[120.0]),
    ] = None


class ClearBody(Attributed, kw_only=True, frozen=True):
    """Which overrides to withdraw; both empty: all."""

    groups: Annotated[
        tuple[Annotated[str, Meta(max_length=64)], ...],
        Meta(
            max_length=64,
            description="overrides of any of these groups; empty: of all groups",
            examples=[["south_east"]],
        ),
    ] = ()
    verb: Annotated[
        Literal["", "call", "hold", "force_off", "omit", "preempt", "policy"],
        Meta(description="overrides of this kind; empty: of any", examples=["hold"]),
    ] = ""


class ResetBody(Body, kw_only=True, frozen=True):
    """Who clears a fault, and why: both end up in the log."""

    by: By = ""
    reason: Annotated[
        str,
        Meta(
            min_length=1, max_length=500, description="why it is over", examples=["lamp replaced"]
        ),
    ]
