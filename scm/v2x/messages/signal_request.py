"""An operator override of a junction's signals; it never sets a colour."""

from typing import ClassVar, Literal

from scm.records.fields import JunctionName, PendingName, PolicyName
from scm.records.signals import SignalOverride, Verb
from scm.v2x.message import Message, Request


class SignalReply(Message, kw_only=True, frozen=True):
    """The request was accepted: what is in force now, and what comes at the next safe moment.

    Attributes:
        policy: In force now.
        pending: The policy to come into force; empty: none.
        wishes: Overrides in force.
    """

    KEY: ClassVar[str] = "tl/{junction}/wish/reply"

    junction: JunctionName
    policy: PolicyName
    pending: PendingName = ""
    wishes: tuple[SignalOverride, ...] = ()


class SignalRequest(Request, kw_only=True, frozen=True):
    """Override signal groups for a time; then the junction goes back to its plan.

    Attributes:
        verb: `call`: serve them once. `hold`: stay green, once green. `force_off`: end the green
            when its least time is over and others are called. `omit`: do not begin. `preempt`: go
            to this one group and stay. `policy`: run the one named. `clear`: withdraw all
            overrides, or those for these groups.
        clears: With `clear`: withdraws overrides with this verb alone; empty: with any.
        by: Who requests it; `reason`: why. Both are published.
        expires_s: When it ends, from now; 900 s at most.
    """

    KEY: ClassVar[str] = "tl/{junction}/wish"
    REPLY: ClassVar[type[Message]] = SignalReply
    SERVER: ClassVar[str] = "the signal controller of junction {junction}"

    junction: str
    verb: Verb
    groups: tuple[str, ...] = ()
    by: str
    reason: str = ""
    expires_s: float = 60.0
    policy: str = ""
    clears: Verb | Literal[""] = ""


MESSAGE = SignalRequest
