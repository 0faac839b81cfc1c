"""What the twin part knows of a car: since when it has changed, and its file's versions."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from scm.records.fields import TNs
from scm.records.floor import Record
from scm.v2x.message import Delivery, Message


class TwinParameter(Record, kw_only=True, frozen=True):
    """A parameter of an effect with its 90 % interval, in the unit in which its name ends.

    Attributes:
        before: Its value before the change; None: the effect was not there.
    """

    name: Annotated[str, Meta(examples=["offset_rad"])]
    value: float
    low: float
    high: float
    before: float | None = None


class TwinEffect(Record, kw_only=True, frozen=True):
    """An effect that explains a change.

    Attributes:
        probability: Among all that were tried.
        parameters: As it is since the change.
        text: What a mechanic would say.
    """

    name: Annotated[str, Meta(examples=["steer_trim"])]
    probability: float
    parameters: tuple[TwinParameter, ...]
    text: str = ""


class TwinChange(Record, kw_only=True, frozen=True):
    """A change of a car.

    Attributes:
        noticed_ns: When it was noticed, on the clock of the car's reports.
        since_ns: When it most likely began; `since_low_ns` to `since_high_ns` with 90 %.
        effect: Known effect whose change looks most like it; its `parameter` changed by `size`.
        unit: Of `size`.
        score: In standard deviations of what is usual.
        alike: Further effects that look nearly as much like it, the best first.
        search: How far the search for its cause is. `driving`: more driving is needed; `waiting`;
            `searching`; `named`; `undecided`: `between` these; `unexplained`: by no known effect;
            `failed`: why, says `text`.
        effects: That explain it, the likeliest first.
        between: Effects that this driving cannot tell apart.
        drive_this: The drive that would.
        text: The result in one or two sentences.
        report: Name of the mismatch report; empty: there is none.
    """

    noticed_ns: TNs
    since_ns: TNs
    since_low_ns: TNs
    since_high_ns: TNs
    effect: Annotated[str, Meta(examples=["steer_trim"])]
    parameter: Annotated[str, Meta(examples=["offset_rad"])]
    size: float
    unit: str
    score: float
    alike: tuple[str, ...] = ()
    search: Literal[
        "driving", "waiting", "searching", "named", "undecided", "unexplained", "failed"
    ] = "driving"
    effects: tuple[TwinEffect, ...] = ()
    between: tuple[str, ...] = ()
    drive_this: str = ""
    text: str = ""
    report: str = ""


class TwinError(Record, kw_only=True, frozen=True):
    """An error of predictions, a root mean square in the unit in which its name ends.

    Attributes:
        before: Of the version that another was found from; `now`: of that other.
    """

    name: Annotated[str, Meta(examples=["position_m"])]
    before: float
    now: float


class TwinVersion(Record, kw_only=True, frozen=True):
    """A version of a car's file.

    Attributes:
        number: 0 is the file that the car came with, `car`.
        file: Name or path of the car file.
        made_ns: When it was found.
        state: `candidate`: compared on new driving; `adopted`; `rejected`: not better there;
            `rolled_back`: adopted first; `replaced`: a newer one is.
        after: Number of the version that it was found from.
        effects: That distinguish it, by name.
        by: Who adopted it, rejected it or rolled it back last; `reason` why.
        report: Name of the mismatch report that it comes from.
        windows: Of 3 s, on driving that no fit has seen.
        errors: There, after 3 s.
    """

    number: int
    car: str
    file: str
    made_ns: TNs
    state: Literal["candidate", "adopted", "rejected", "rolled_back", "replaced"]
    after: int = 0
    effects: tuple[str, ...] = ()
    by: str = ""
    reason: str = ""
    report: str = ""
    windows: int = 0
    errors: tuple[TwinError, ...] = ()


class TwinStatus(Message, kw_only=True, frozen=True):
    """One car; sent when it was looked at, about every ten seconds of its driving, and on change.

    Attributes:
        t_ns: Of the look.
        car: Its car file.
        state: `learning` how the car usually strays; `watching`; `blind`: why, says `reason`.
        driven_s: How long it was driven and seen since the part began.
        changes: The newest last; at most 20.
        version: Number of the version in force.
        versions: All, by number; at most the newest 20.
    """

    KEY: ClassVar[str] = "v/{vehicle}/twin"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    vehicle: str
    t_ns: TNs
    car: str
    state: Literal["learning", "watching", "blind"]
    driven_s: float
    reason: str = ""
    changes: tuple[TwinChange, ...] = ()
    version: int = 0
    versions: tuple[TwinVersion, ...] = ()


MESSAGE = TwinStatus
