"""Signal plans: stages, timetable, proof."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scm.records.body import Body, By, Reason
from scm.records.fields import (
    CycleS,
    Digest,
    EndS,
    GroupName,
    GroupNames,
    JunctionName,
    PlanName,
    PolicyName,
    Purpose,
    ReasonText,
    RequestedBy,
    StartS,
)


class SignalStage(msgspec.Struct, kw_only=True, frozen=True):
    """Groups that are green together, for how long, and how much later the next stage begins.

    Messages, answers and the store share it. `StageBody` stays apart: it bounds what people send.

    Groups of the next stage as well stay green between them; all others are red meanwhile.

    Attributes:
        green_s: The stage's split without yellow and red clear of those that leave it, which the
            kernel adds.
        extra_red_s: On top of red clear.
    """

    groups: GroupNames
    green_s: float
    extra_red_s: float = 0.0


class SignalPhase(msgspec.Struct, kw_only=True, frozen=True):
    """A phase: one signal group, and the times that the kernel and the rings keep.

    Attributes:
        min_green_s: Green lasts at least so long [s].
        yellow_s: Yellow change.
        red_clear_s: Red clear, all red before anybody in conflict may start.
        passage_s: A green gaps out this long after the last vehicle.
        max1_s, max2_s: A green ends after it once others are called; max 2 holds in queues.
    """

    group: GroupName
    min_green_s: float
    yellow_s: float
    red_clear_s: float
    passage_s: float
    max1_s: float
    max2_s: float


class StageInterval(msgspec.Struct, kw_only=True, frozen=True):
    """A stage of a cycle: green from `start_s` to `end_s` after the cycle's begin."""

    groups: GroupNames
    start_s: StartS
    end_s: EndS


class SignalPlan(msgspec.Struct, kw_only=True, frozen=True):
    """A fixed-time plan as this junction runs it.

    Attributes:
        stages: What makes it.
        slots: Its timetable; yellow and red clear lie between two of them, for groups that are
            not in both.
        in_step: Whether it keeps a common cycle with other junctions: a green wave.
        offset_s: When its cycle begins in the common one; None: it keeps none.
    """

    plan: PlanName
    about: Purpose
    cycle_s: CycleS
    stages: tuple[SignalStage, ...]
    slots: tuple[StageInterval, ...]
    in_step: bool = False
    offset_s: float | None = None


class SignalPolicy(msgspec.Struct, kw_only=True, frozen=True):
    """A policy that may be requested; `has_detectors`: it uses detectors.

    Attributes:
        has_detectors: Whether it listens for cars.
    """

    policy: PolicyName
    about: Purpose
    has_detectors: bool


class PlanProof(msgspec.Struct, kw_only=True, frozen=True):
    """What the search walked through without finding fault.

    Attributes:
        digest: Of what was proven.
        states, transitions: Of the kernel, under any requests.
        plan_states, plan_transitions: Of the kernel under this plan, however late its steps.
        cycle_s: What the stages make, with yellow and red clear.
        took_s: How long the search took.
    """

    digest: Digest
    states: int
    transitions: int
    plan_states: int
    plan_transitions: int
    cycle_s: CycleS
    took_s: float


class PlanRow(msgspec.Struct, kw_only=True, frozen=True):
    """A plan that may be requested.

    Attributes:
        source: `shipped` with the city or its map, or `saved` by somebody.
        usable: Whether it is proven for the junction as it is now.
        stages: Its stages, in the order of the cycle.
        offset_s: When its cycle begins, after a time that is a whole number of cycles on the
            controller's clock; null: not coordinated.
        saved_ns: When it was saved; 0: it was not.
        proof: What the search found of it; null: not searched.
    """

    junction: JunctionName
    plan: PlanName
    about: Purpose
    source: Literal["shipped", "saved"]
    usable: bool
    cycle_s: CycleS
    stages: tuple[SignalStage, ...]
    offset_s: float | None = None
    by: RequestedBy = ""
    reason: ReasonText = ""
    saved_ns: int = 0
    proof: PlanProof | None = None


class StageBody(Body, kw_only=True, frozen=True):
    """One stage of the cycle; yellow and red clear after it are the kernel's.

    A record beside `SignalStage`, whose bounds would refuse a stage that was stored before them.
    """

    groups: Annotated[
        tuple[Annotated[str, Meta(max_length=64)], ...],
        Meta(
            min_length=1, max_length=64, description="that are green together", examples=[["north"]]
        ),
    ]
    green_s: Annotated[
        float, Meta(ge=0.0, le=300.0, description="how long they are green", examples=[12.0])
    ]
    extra_red_s: Annotated[
        float, Meta(ge=0.0, le=300.0, description="all red on top of red clear", examples=[1.0])
    ] = 0.0


class StagesBody(Body, kw_only=True, frozen=True):
    """What to prove."""

    plan: Annotated[
        str,
        Meta(
            pattern="^[a-z][a-z0-9_-]{0,31}$",
            description="what the plan will be called",
            examples=["rush"],
        ),
    ]
    stages: Annotated[
        tuple[StageBody, ...],
        Meta(
            min_length=1,
            max_length=24,
            description="in the order of the cycle",
            examples=[[{"groups": ["north"], "green_s": 12.0, "extra_red_s": 0.0}]],
        ),
    ]


class PlanBody(Body, kw_only=True, frozen=True):
    """A plan to save; these very stages must have been proven for this junction."""

    about: Annotated[
        str,
        Meta(max_length=200, description="what it is for", examples=["more green for the north"]),
    ] = ""
    by: By = ""
    reason: Reason = ""
    stages: Annotated[
        tuple[StageBody, ...],
        Meta(
            min_length=1,
            max_length=24,
            description="in the order of the cycle",
            examples=[[{"groups": ["north"], "green_s": 12.0, "extra_red_s": 0.0}]],
        ),
    ]
    offset_s: (
        Annotated[
            float,
            Meta(
                ge=0.0,
                lt=300.0,
                description=(
                    "when its cycle begins, after a time that is a whole number of "
                    "cycles on the controller's clock, less than the cycle; plans with "
                    "the same cycle are then coordinated; null: no offset"
                ),
                examples=[9.6],
            ),
        ]
        | None
    ) = None
