"""A wish for a junction's signals in a traffic engineer's words; nobody ever sets a colour."""

from typing import ClassVar, Literal

from scm.records.signals import SignalOverride, Verb
from scm.v2x.message import Message, Request


class SignalReply(Message, kw_only=True, frozen=True):
    """The wish was taken; what is in force now, and what is to come at the next safe moment.

    Attributes:
        policy: In force now.
        pending: The policy to come into force; empty: none.
    """

    KEY: ClassVar[str] = "tl/{junction}/wish/reply"

    junction: str
    policy: str
    pending: str = ""
    wishes: tuple[SignalOverride, ...] = ()


class SignalRequest(Request, kw_only=True, frozen=True):
    """Wish something for signal groups; it lapses, and then the junction goes back to its plan.

    Attributes:
        verb: `call`: serve them once. `hold`: stay green, once green. `force_off`: end the green
            when its least time is over and others are called. `omit`: do not begin. `preempt`: go
            to this one group and stay. `policy`: run the one named. `clear`: take back all
            wishes, or those for these groups.
        clears: With `clear`: takes back wishes with this verb alone; empty: with any.
        by: Who wishes; `reason`: why. Both are told.
        expires_s: When the wish lapses, from now; 900 s at most.
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
