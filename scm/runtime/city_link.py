"""The contract of a script's link to a city; `scm.fleet` has one in lockstep and a live one."""

from collections.abc import Callable
from typing import Protocol

from scm.runtime.part import Subscription
from scm.v2x.exchange import Incoming
from scm.v2x.mailbox import Mailbox
from scm.v2x.message import Message, Request

Keep = Callable[[Incoming], bool]
"""Whether a mailbox accepts a message."""


class Link(Protocol):
    """How a script reaches a city: live or in lockstep."""

    @property
    def now_ns(self) -> int:
        """The city's time [ns]."""
        ...

    def request(self, request: Request) -> Message:
        """Return the reply to a request, or a `Refused`."""
        ...

    def subscribe(self, subscription: Subscription, keep: Keep | None = None) -> Mailbox:
        """Return a mailbox that fills from now on with the messages that `keep` accepts.

        `keep` may be called on another thread.
        """
        ...

    def publish(self, message: Message) -> None:
        """Send a message from the script."""
        ...

    def run_until(self, done: Callable[[], bool], timeout_s: float) -> bool:
        """Let the city run until `done()`; return whether that was in time."""
        ...
