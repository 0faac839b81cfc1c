"""What the twin part knows of a car: since when it has changed, and its file's versions."""

import math
from typing import ClassVar, Literal

from scm.records.fields import TNs
from scm.records.twins import TwinChange, TwinParameter, TwinVersion
from scm.v2x.message import Delivery, Message


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

    @property
    def in_force(self) -> TwinVersion | None:
        """The version in force; None: it is not listed."""
        return next((one for one in self.versions if one.number == self.version), None)


def ability_problem(ability: TwinParameter) -> str:
    """Return what is wrong with an ability of a version; empty: it can be relied on."""
    numbers = (ability.low, ability.value, ability.high)
    if all(map(math.isfinite, numbers)) and 0.0 <= ability.low <= ability.value <= ability.high:
        return ""
    got = ", ".join(f"{number:g}" for number in numbers)
    return f"{ability.name}: got {got}, expected three numbers from 0 on that do not fall"


MESSAGE = TwinStatus
