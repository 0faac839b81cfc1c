"""The bus contract: publish, subscribe, ask, answer, and know who is there.

Two buses keep it: `ZenohBus` between processes and machines, `MemoryBus` inside one. The same
contract test runs over both. Nothing here calls back into a part: what arrives waits in a bounded
`Mailbox` until its owner drains it, the oldest dropped (and counted) when it is full. Whoever
subscribes to what it publishes itself receives it too.
"""

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Protocol, Self

from scm.errors import MessageError
from scm.v2x.exchange import Answer, Call, Incoming
from scm.v2x.mailbox import Mailbox, RawMailbox
from scm.v2x.message import Message, Refused, Request

__all__ = ["Bus", "Mailbox", "RawMailbox"]


class Bus(Protocol):
    """One station's connection to its city; a context manager that always closes.

    Attributes:
        city: Whose keys are used.
        station: The name this connection is known by.
        session: Which run of the station this is: no two connections ever share it.
        rejected: How many arrivals were dropped because they could not be read.
    """

    city: str
    station: str
    session: str

    @property
    def connected(self) -> bool:
        """Whether the city can be reached now; what is published meanwhile is dropped."""
        ...

    @property
    def rejected(self) -> int:
        """How many arrivals were dropped because they could not be read."""
        ...

    def publish(self, message: Message) -> None:
        """Send a message on its own key; never blocks for a slow receiver."""
        ...

    def subscribe(self, kind: type[Message], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Bring messages of a class into a mailbox until the bus is closed.

        Of an EVENT the last ones of each sender that is still there come first. `Presence` tells
        of everybody who is there already, then who comes and goes.
        """
        ...

    def subscribe_raw(
        self,
        mailbox: RawMailbox,
        kind: type[Message] | None = None,
        where: Mapping[str, str] | None = None,
    ) -> None:
        """Bring everything that is published in the city into a mailbox, unread.

        Messages whose key has a verbatim chunk (`@camera`) come only to those who name their
        class: `kind` asks for one class alone, `where` for some of it.
        """
        ...

    def unsubscribe(self, mailbox: Mailbox) -> None:
        """Bring nothing more into a mailbox; what waits in it stays."""
        ...

    def is_wanted(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class; cheap enough for each step.

        Key parts left out of `where` match everything: it is true if any of them is wanted.
        """
        ...

    def serve(self, kind: type[Request], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Bring requests of a class into a mailbox; each waits there for its `answer`."""
        ...

    def answer(self, answer: Answer) -> None:
        """Reply to a request that came from `serve`; a second answer to the same is ignored."""
        ...

    def call(self, call: Call, on_reply: Callable[[Incoming], None]) -> None:
        """Ask, and hand the reply (or a `Refused`) to `on_reply` later; never blocks.

        Of several servers the first that does not refuse is heard; if all do, the last one with
        another reason than `not_found`. `on_reply` runs once, perhaps on a thread of the bus: it
        may only fill a mailbox or set an event.
        """
        ...

    def announce(self, role: str) -> None:
        """Declare this station present until the bus closes or its process dies."""
        ...

    def close(self) -> None:
        """Leave; safe to call twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


def check_reply(answer: Answer) -> None:
    """Refuse to send a reply of a class that the request does not promise.

    Raises:
        MessageError: naming both.
    """
    request, reply = answer.to.message, answer.reply
    if not isinstance(request, Request):
        msg = f"{type(request).__name__} is no request: it cannot be answered"
        raise MessageError(msg)
    if not isinstance(reply, (request.REPLY, Refused)):
        msg = (
            f"{type(request).__name__}: got the reply {type(reply).__name__}, "
            f"expected {request.REPLY.__name__} or Refused"
        )
        raise MessageError(msg)


def no_server(request: Request, key: str) -> Refused:
    """Return the refusal of a request that nobody serves."""
    detail = f"{request.server} is not running, or cannot be reached"
    return Refused(code="offline", detail=detail, asked=_describe(request, key))


def no_link(request: Request, key: str) -> Refused:
    """Return the refusal of a request that cannot even leave."""
    detail = "the city cannot be reached: there is no connection to its router"
    return Refused(code="offline", detail=detail, asked=_describe(request, key))


def more_informative(before: Refused | None, now: Refused) -> Refused:
    """Return which of two refusals to tell: whoever knows the thing says more than who does not."""
    return before if before is not None and now.code == "not_found" else now


def no_answer(call: Call, key: str) -> Refused:
    """Return the refusal of a call that was not answered in time."""
    detail = f"{call.request.server} did not answer within {call.timeout_s:g} s"
    return Refused(code="timeout", detail=detail, asked=_describe(call.request, key))


def _describe(request: Request, key: str) -> str:
    return f"{type(request).__name__} on {key}"
