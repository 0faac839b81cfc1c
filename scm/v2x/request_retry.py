"""Retry a request with the same id until there is an answer.

Without a reply it is unknown whether the request, its answer or the server was lost. Since the id
stays the same and servers store their answers, a retry is safe: the effect happens once.
`RetriedRequest` is the rule alone, for parts and stepped clocks; `send_request` blocks on a live
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
    """Return the request with a unique id, unless it already has an id."""
    if request.request_id:
        return request
    return msgspec.structs.replace(request, request_id=uuid.uuid4().hex)


class RetriedRequest:
    """One request with its retries.

    Args:
        request: The request; it needs an id if a repetition would repeat its effect.
        now_ns: The present time.
        deadline_s: For how long it is retried.
        try_s: Timeout of one try.

    Attributes:
        reply: The answer, or a `Refused` after the deadline; None: not yet.
        tries: Number of tries so far.
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
        """Time of the next try; None: a try is in progress, or there is a reply."""
        return None if self.reply is not None else self._next_ns

    def due(self, now_ns: int) -> Call | None:
        """Return the call that is due now, or None."""
        if self.next_ns is None or now_ns < self.next_ns:
            return None
        self.tries += 1
        self._next_ns = None
        left_s = max(0.0, (self._ends_ns - now_ns) / 1e9)
        return Call(self.request, min(self._try_s, left_s) if self.tries > 1 else self._try_s)

    def receive(self, reply: Incoming) -> None:
        """Handle the reply to a try; a timeout or `offline` leads to another try in time."""
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
            f"{last.detail}; tried {self.tries} times in {self._deadline_s:g} s. It may have been "
            "done all the same"
        )
        again = f"repeat it with request_id {self.request.request_id!r} to learn whether it was"
        return Refused(code=last.code, detail=detail, asked=f"{last.asked}; {again}".lstrip("; "))


def send_request(
    bus: Bus,
    request: Request,
    deadline_s: float = 2.0,
    *,
    try_s: float = DEFAULT_TRY_S,
    clock: Clock | None = None,
) -> Message:
    """Send a request, retry it until the deadline, and return the reply or a `Refused`.

    All tries have one id, so the effect happens once.
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
