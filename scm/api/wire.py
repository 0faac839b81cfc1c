"""The interface's side of the bus: requests, commands, and requests that nobody stores."""

import threading
from typing import Protocol

from scm.api.trace import traced
from scm.v2x.bus import Bus, no_answer
from scm.v2x.exchange import Call, Incoming
from scm.v2x.key import key_of
from scm.v2x.message import Message, Request
from scm.v2x.request_retry import send_request

SLACK_S = 0.5


class Wire(Protocol):
    """What teleoperation needs of the bus; safe from any thread."""

    def publish(self, message: Message) -> None:
        """Publish; never waits for a slow receiver.

        Raises:
            LinkError: when the bus is closed.
        """
        ...

    def request_once(self, request: Request, timeout_s: float) -> Message:
        """Return the reply, or a `Refused`; sent once, without an id, so that none is stored.

        Raises:
            LinkError: when the bus is closed.
        """
        ...


class BusWire:
    """The wire of a real bus."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def publish(self, message: Message) -> None:
        """Publish."""
        self._bus.publish(message)

    def request(self, request: Request, timeout_s: float) -> Message:
        """Send a request until there is a reply, under an id, with the trace of the call."""
        return send_request(self._bus, traced(request), timeout_s)

    def request_once(self, request: Request, timeout_s: float) -> Message:
        """Send a request, and wait for the reply."""
        replied = threading.Event()
        replies: list[Incoming] = []

        def receive(reply: Incoming) -> None:
            replies.append(reply)
            replied.set()

        self._bus.call(Call(request, timeout_s), receive)
        if replied.wait(timeout_s + SLACK_S):
            return replies[0].message
        return no_answer(Call(request, timeout_s), key_of(self._bus.city, request))
