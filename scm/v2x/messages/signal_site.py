"""What a junction's signals are: groups with their least times, conflicts, rings, and its plans."""

from typing import Annotated, ClassVar

from msgspec import Meta

from scm.records.fields import JunctionName, TNs
from scm.records.signal_plans import SignalPhase, SignalPlan, SignalPolicy
from scm.v2x.message import Delivery, Message


class SignalSite(Message, kw_only=True, frozen=True):
    """One junction, for late joiners; published at the start and every 10 s.

    Attributes:
        phases: Signal groups with their least times.
        conflicts: Pairs of groups that are never green together.
        rings: `rings[section][ring]` is the sequence of groups between two barriers.
        plans: Names of the signal plans offered.
        policies: Policies that may be requested.
    """

    KEY: ClassVar[str] = "tl/{junction}/site"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    junction: JunctionName
    t_ns: TNs
    phases: tuple[SignalPhase, ...]
    conflicts: Annotated[tuple[tuple[str, str], ...], Meta(examples=[[["north", "east"]]])]
    rings: Annotated[
        tuple[tuple[tuple[str, ...], ...], ...], Meta(examples=[[[["north"], ["east"]]]])
    ]
    plans: tuple[SignalPlan, ...]
    policies: tuple[SignalPolicy, ...]


MESSAGE = SignalSite
