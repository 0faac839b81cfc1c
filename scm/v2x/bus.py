"""The bus contract: publish, subscribe, request, answer, and presence.

`ZenohBus` implements it between processes and machines, `MemoryBus` inside one process; the same
contract test covers both. The bus never calls back into a part: arrivals wait in a bounded
`Mailbox` until its owner drains it; when it is full the oldest are dropped and counted. A station
that subscribes to its own messages receives them too.
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
        station: The name of this connection.
        session: Unique id of this connection.
        rejected: How many arrivals were dropped because they could not be read.
    """

    city: str
    station: str
    session: str

    @property
    def connected(self) -> bool:
        """Whether the city is reachable now; messages published while it is not are dropped."""
        ...

    @property
    def rejected(self) -> int:
        """How many arrivals were dropped because they could not be read."""
        ...

    def publish(self, message: Message, city: str = "") -> None:
        """Send a message on its own key; never blocks on a slow receiver.

        `city` is another city, on whose keys it is sent.
        """
        ...

    def subscribe(self, kind: type[Message], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver messages of a class to a mailbox until the bus is closed.

        For an EVENT the last ones of each sender that is still present come first. For `Presence`
        all present stations come first, then arrivals and departures.
        """
        ...

    def subscribe_raw(
        self,
        mailbox: RawMailbox,
        kind: type[Message] | None = None,
        where: Mapping[str, str] | None = None,
    ) -> None:
        """Deliver everything that is published in the city to a mailbox, undecoded.

        Messages whose key has a verbatim chunk (`@camera`) are delivered only if `kind` names their
        class; `where` selects some of that class.
        """
        ...

    def unsubscribe(self, mailbox: Mailbox) -> None:
        """Stop delivery to a mailbox; its contents stay."""
        ...

    def is_wanted(self, kind: type[Message], where: Mapping[str, str]) -> bool:
        """Return whether anybody subscribes to messages of a class; cheap enough for each step.

        Key parts left out of `where` match everything.
        """
        ...

    def serve(self, kind: type[Request], where: Mapping[str, str], mailbox: Mailbox) -> None:
        """Deliver requests of a class to a mailbox; each needs an `answer`."""
        ...

    def answer(self, answer: Answer) -> None:
        """Reply to a request from `serve`; a second answer to the same request is ignored."""
        ...

    def call(self, call: Call, on_reply: Callable[[Incoming], None]) -> None:
        """Send a request and pass the reply (or a `Refused`) to `on_reply` later; never blocks.

        Of several services the first that does not refuse counts; if all refuse, the last one with
        another reason than `not_found`. `on_reply` runs once, maybe on a thread of the bus: it may
        only fill a mailbox or set an event.
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
    """Check that a reply has the class that its request declares.

    Raises:
        MessageError: when it has not.
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
    """Return the refusal of a request without a service."""
    detail = f"{request.server} is not running, or cannot be reached"
    return Refused(code="offline", detail=detail, asked=_describe(request, key))


def no_link(request: Request, key: str) -> Refused:
    """Return the refusal of a request that cannot be sent."""
    detail = "the city cannot be reached: there is no connection to its router"
    return Refused(code="offline", detail=detail, asked=_describe(request, key))


def more_informative(before: Refused | None, now: Refused) -> Refused:
    """Return the more informative of two refusals: any other reason beats `not_found`."""
    return before if before is not None and now.code == "not_found" else now


def no_answer(call: Call, key: str) -> Refused:
    """Return the refusal of a call that was not answered in time."""
    detail = f"{call.request.server} did not answer within {call.timeout_s:g} s"
    return Refused(code="timeout", detail=detail, asked=_describe(call.request, key))


def _describe(request: Request, key: str) -> str:
    return f"{type(request).__name__} on {key}"
