"""What passes between a part and its bus: things that come in, calls, and answers."""

from dataclasses import dataclass

import msgspec

from scm.store.repository import Table
from scm.v2x.message import Message, Request


@dataclass(frozen=True, slots=True, eq=False)
class Call:
    """Ask a request of whoever serves it; the reply comes to a later inbox with `call` set."""

    request: Request
    timeout_s: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Incoming:
    """One thing that reached a part: a message, a request to answer, or the reply to a call.

    Attributes:
        message: What arrived. For a reply: the reply, or a `Refused` when the call failed.
        t_ns: When it reached this process, on this process's own clock [ns].
        call: The `Call` this answers; None for messages and requests.
    """

    message: Message
    t_ns: int
    call: Call | None = None


@dataclass(frozen=True, slots=True)
class RawSample:
    """One message as it travelled, unread: for whoever records or relays everything.

    Attributes:
        key: The whole key it was sent on.
        body: JSON, or the raw payload of a bulk message.
        attachment: The JSON header of a bulk message; else None.
        t_ns: When it reached this process, on this process's own clock [ns].
    """

    key: str
    body: bytes
    attachment: bytes | None
    t_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The reply to a request that came in."""

    to: Incoming
    reply: Message


@dataclass(frozen=True, slots=True)
class Keep:
    """State that must outlive the process: stored before any answer of the same step leaves.

    A runner without a store passes over it.

    Attributes:
        table: Where.
        key: Under what name, beside what is there of other parts.
        value: The record; None: forget it.
    """

    table: Table
    key: str
    value: msgspec.Struct | None


Outgoing = Message | Call | Answer | Keep
