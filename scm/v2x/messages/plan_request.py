"""A wish for a junction's signals: another plan, or flashing red. The kernel decides when."""

from typing import ClassVar

from scm.v2x.message import Message, Request


class PlanReply(Message, kw_only=True, frozen=True):
    """The wish was taken.

    Attributes:
        plan: In force now.
        pending: To come into force at the next safe moment; empty: none.
    """

    KEY: ClassVar[str] = "tl/{junction}/req/reply"

    junction: str
    plan: str
    pending: str = ""


class PlanRequest(Request, kw_only=True, frozen=True):
    """Use a plan by name, or `flash`; with who asks and why."""

    KEY: ClassVar[str] = "tl/{junction}/req"
    REPLY: ClassVar[type[Message]] = PlanReply

    junction: str
    plan: str
    by: str
    reason: str = ""


MESSAGE = PlanRequest
