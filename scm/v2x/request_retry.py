"""Ask until there is an answer: the same request, with the same id, again and again.

A reply that does not come tells nothing: the request, its answer or the server may be lost. Because
the id stays the same and servers keep their answers, asking again is safe: what the request does
is done once. `Asking` is the rule alone, for parts and stepped clocks; `ask` waits over a live
bus, for scripts and web requests.
"""

import threading
import uuid

import msgspec

from scm.clock import Clock, WallClock, nanoseconds
from scm.v2x.bus import Bus, no_answer
from scm.v2x.exchange import Call, Incoming
from scm.v2x.key import key_of
from scm.v2x.message import Message, Refused, Request

DEFAULT_TRY_S = 1.0
FIRST_PAUSE_S = 0.1
MAX_PAUSE_S = 1.0
RETRIED_CODES = ("timeout", "offline")


def with_id(request: Request) -> Request:
    """Return the request with an id that no other one has, unless it has one."""
    if request.request_id:
        return request
    return msgspec.structs.replace(request, request_id=uuid.uuid4().hex)


class RetriedRequest:
    """One request on its way to its answer.

    Args:
        request: What is asked; it needs an id if asking twice would do it twice.
        now_ns: The time.
        deadline_s: For how long it is asked again.
        try_s: How long one try waits for its reply.

    Attributes:
        reply: The answer, or a `Refused` when the deadline is over; None: not yet.
        tries: How often it was asked.
    """

    def __init__(
        self, request: Request, now_ns: int, deadline_s: float, try_s: float = DEFAULT_TRY_S
    ) -> None:
        self.request = request
        self.reply: Message | None = None
        self.tries = 0
        self._deadline_s = deadline_s
        self._try_s = try_s
        self._ends_ns = now_ns + nanoseconds(deadline_s)
        self._next_ns: int | None = now_ns
        self._pause_s = FIRST_PAUSE_S

    @property
    def next_ns(self) -> int | None:
        """When to ask next; None: a try is under way, or it is over."""
        return None if self.reply is not None else self._next_ns

    def due(self, now_ns: int) -> Call | None:
        """Return what is to be asked now, if anything."""
        if self.next_ns is None or now_ns < self.next_ns:
            return None
        self.tries += 1
        self._next_ns = None
        left_s = max(0.0, (self._ends_ns - now_ns) / 1e9)
        return Call(self.request, min(self._try_s, left_s) if self.tries > 1 else self._try_s)

    def receive(self, reply: Incoming) -> None:
        """Take the reply to a try; what is no answer leads to another one while there is time."""
        message = reply.message
        if not isinstance(message, Refused) or message.code not in RETRIED_CODES:
            self.reply = message
            return
        self._next_ns = reply.t_ns + nanoseconds(self._pause_s)
        self._pause_s = min(2.0 * self._pause_s, MAX_PAUSE_S)
        if self._next_ns >= self._ends_ns:
            self.reply = self._give_up(message)

    def _give_up(self, last: Refused) -> Refused:
        if self.tries == 1:
            return last
        detail = (
            f"{last.detail}; asked {self.tries} times in {self._deadline_s:g} s. It may have been "
            "done all the same"
        )
        again = f"ask again with request_id {self.request.request_id!r} to learn whether it was"
        return Refused(code=last.code, detail=detail, asked=f"{last.asked}; {again}".lstrip("; "))


def send_request(
    bus: Bus,
    request: Request,
    deadline_s: float = 2.0,
    *,
    try_s: float = DEFAULT_TRY_S,
    clock: Clock | None = None,
) -> Message:
    """Return the reply, or a `Refused` when it was refused or nobody answered in time.

    It is asked again until the deadline, under one id: an effect happens once.
    """
    clock, never = clock or WallClock(), threading.Event()
    pending = RetriedRequest(with_id(request), clock.now_ns(), deadline_s, try_s)
    while pending.reply is None:
        call = pending.due(clock.now_ns())
        if call is None:
            clock.wait_until(pending.next_ns or 0, never)
            continue
        message = _try(bus, call)
        pending.receive(Incoming(message, clock.now_ns(), call))
    return pending.reply


def _try(bus: Bus, call: Call) -> Message:
    replied = threading.Event()
    replies: list[Incoming] = []

    def on_reply(reply: Incoming) -> None:
        replies.append(reply)
        replied.set()

    bus.call(call, on_reply)
    if replied.wait(call.timeout_s + 0.5):
        return replies[0].message
    return no_answer(call, key_of(bus.city, call.request))
