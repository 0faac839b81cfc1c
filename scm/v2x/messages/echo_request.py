"""Whether a car is there, and its time: answered by the car's owner, with no effect."""

from typing import ClassVar

from scm.v2x.message import Message, Request


class EchoReply(Message, kw_only=True, frozen=True):
    """`t_ns` is the owner's clock when it answered."""

    KEY: ClassVar[str] = "v/{vehicle}/cmd/echo/reply"

    vehicle: str
    t_ns: int


class EchoRequest(Request, kw_only=True, frozen=True):
    """Measures the way to a car and back; neither stored nor logged, so leave `request_id` empty.

    The answer waits for the owner's next step: up to 20 ms of what is measured.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/echo"
    REPLY: ClassVar[type[Message]] = EchoReply
    SERVER: ClassVar[str] = "the program that drives {vehicle}"
    HAS_EFFECT: ClassVar[bool] = False

    vehicle: str


MESSAGE = EchoRequest
