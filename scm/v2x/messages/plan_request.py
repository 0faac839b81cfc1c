"""A request to a junction's signals: another plan, or flashing red. The kernel decides when."""

from typing import ClassVar

from scm.records.fields import JunctionName, PendingName, PlanName
from scm.records.signal_plans import SignalStage
from scm.v2x.message import Message, Request


class PlanReply(Message, kw_only=True, frozen=True):
    """The request was accepted.

    Attributes:
        plan: In force now.
        pending: To come into force at the next safe moment; empty: none.
    """

    KEY: ClassVar[str] = "tl/{junction}/req/reply"

    junction: JunctionName
    plan: PlanName
    pending: PendingName = ""


class PlanRequest(Request, kw_only=True, frozen=True):
    """Use a plan by name, or `flash`; with who requests it and why.

    Attributes:
        plan: Empty: end a flash that a person requested; what ran, what is to come and overrides
            stay.
        stages: Of a plan that the junction does not have: it is checked, taken and run under that
            name for as long as it is wanted. Empty: one of its own.
        offset_s: Of these stages: when their cycle begins, after a time that is a whole number of
            cycles on the controller's clock. None: it begins whenever it can, not coordinated.
    """

    KEY: ClassVar[str] = "tl/{junction}/req"
    REPLY: ClassVar[type[Message]] = PlanReply
    SERVER: ClassVar[str] = "the signal controller of junction {junction}"

    junction: str
    plan: str
    by: str
    reason: str = ""
    stages: tuple[SignalStage, ...] = ()
    offset_s: float | None = None


MESSAGE = PlanRequest
