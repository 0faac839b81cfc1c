"""What the twin part knows of a car: whether and since when it is not what its car file says."""

from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from scm.records.fields import TNs
from scm.records.floor import Record
from scm.v2x.message import Delivery, Message


class TwinChange(Record, kw_only=True, frozen=True):
    """A change of a car.

    Attributes:
        noticed_ns: When it was noticed, on the clock of the car's reports.
        since_ns: When it most likely began; `since_low_ns` to `since_high_ns` with 90 %.
        effect: Known effect whose change looks most like it; its `parameter` changed by `size`.
        unit: Of `size`.
        score: In standard deviations of what is usual.
        alike: Further effects that look nearly as much like it, the best first.
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


class TwinStatus(Message, kw_only=True, frozen=True):
    """One car; sent when it was looked at, about every ten seconds of its driving.

    Attributes:
        t_ns: Of the look.
        car: Its car file.
        state: `learning` how the car usually strays; `watching`; `blind`: why, says `reason`.
        driven_s: How long it was driven and seen since the part began.
        changes: Since then, the newest last; at most 20.
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


MESSAGE = TwinStatus
