"""What a part exchanges with its bus: incoming items, calls, answers, and state to persist."""

from dataclasses import dataclass

import msgspec

from scm.store.repository import Table
from scm.v2x.message import Message, Request


@dataclass(frozen=True, slots=True, eq=False)
class Call:
    """Send a request; the reply comes in a later inbox with `call` set.

    Attributes:
        city: Whose keys it is sent on; empty: the sender's own city.
        after_store: Send it only when the state of the same step is stored.
    """

    request: Request
    timeout_s: float = 2.0
    city: str = ""
    after_store: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ToCity:
    """Publish a message on another city's keys."""

    city: str
    message: Message


@dataclass(frozen=True, slots=True, eq=False)
class Incoming:
    """One item that reached a part: a message, a request to answer, or the reply to a call.

    Attributes:
        message: The message, request, or reply (a `Refused` when the call failed).
        t_ns: When it reached this process, on this process's own clock [ns].
        call: The `Call` this answers; None for messages and requests.
    """

    message: Message
    t_ns: int
    call: Call | None = None


@dataclass(frozen=True, slots=True)
class RawSample:
    """One undecoded message, for recording or relaying everything.

    Attributes:
        key: The whole key.
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
    """The reply to an incoming request."""

    to: Incoming
    reply: Message


@dataclass(frozen=True, slots=True)
class PersistedState:
    """State that must outlive the process: stored before any answer of the same step is sent.

    A runner without a store ignores it.

    Attributes:
        table: Table of the store.
        key: Key of the record, within the part's own.
        value: The record; None: delete it.
    """

    table: Table
    key: str
    value: msgspec.Struct | None


Outgoing = Message | ToCity | Call | Answer | PersistedState
