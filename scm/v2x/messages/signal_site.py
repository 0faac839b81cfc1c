"""What a junction's signals are: groups with their least times, conflicts, rings, and its plans."""

from typing import ClassVar

from scm.records.signal_plans import SignalPhase, SignalPlan, SignalPolicy
from scm.v2x.message import Delivery, Message


class SignalSite(Message, kw_only=True, frozen=True):
    """One junction, for late joiners; published at the start and every 10 s.

    Attributes:
        conflicts: Pairs of groups that are never green together.
        rings: `rings[section][ring]` is the sequence of groups between two barriers.
    """

    KEY: ClassVar[str] = "tl/{junction}/site"
    DELIVERY: ClassVar[Delivery] = Delivery.EVENT

    junction: str
    t_ns: int
    phases: tuple[SignalPhase, ...]
    conflicts: tuple[tuple[str, str], ...]
    rings: tuple[tuple[tuple[str, ...], ...], ...]
    plans: tuple[SignalPlan, ...]
    policies: tuple[SignalPolicy, ...]


MESSAGE = SignalSite
