"""Ask over a live bus and wait for the reply: for scripts and web requests, never for a part."""

import threading

from scm.v2x.bus import Bus
from scm.v2x.exchange import Call, Incoming
from scm.v2x.message import Message, Refused, Request


def ask(bus: Bus, request: Request, timeout_s: float = 2.0) -> Message:
    """Return the reply, or a `Refused` when it was refused or nobody answered in time."""
    replied = threading.Event()
    replies: list[Incoming] = []

    def take(reply: Incoming) -> None:
        replies.append(reply)
        replied.set()

    bus.call(Call(request, timeout_s), take)
    if replied.wait(timeout_s + 0.5):
        return replies[0].message
    what = type(request).__name__
    return Refused(code="timeout", detail=f"{what}: no answer within {timeout_s:g} s")
