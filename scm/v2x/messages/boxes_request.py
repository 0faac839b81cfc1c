"""Put all boxes that were pushed back to where the map has them, at rest."""

from typing import ClassVar

from scm.v2x.message import Message, Request


class BoxesReply(Message, kw_only=True, frozen=True):
    """They stand where they began; `boxes` is how many there are.

    Attributes:
        boxes: Boxes that cars can push.
    """

    KEY: ClassVar[str] = "world/boxes/reply"

    boxes: int


class BoxesRequest(Request, kw_only=True, frozen=True):
    """Reset the boxes; `by` is for the event log."""

    KEY: ClassVar[str] = "world/boxes"
    REPLY: ClassVar[type[Message]] = BoxesReply
    SERVER: ClassVar[str] = "the world"

    by: str = ""


MESSAGE = BoxesRequest
