"""Take a car off the map: a hosted one by anybody, a remote one by its own agent as it leaves."""

from typing import ClassVar

from scm.records.fields import VehicleName
from scm.v2x.message import Message, Request


class RemoveReply(Message, kw_only=True, frozen=True):
    """It is gone."""

    KEY: ClassVar[str] = "v/{vehicle}/remove/reply"

    vehicle: VehicleName


class RemoveRequest(Request, kw_only=True, frozen=True):
    """Remove a car, with a reason for the event log.

    Attributes:
        session: The car that joined by this session, and no other of its name; empty: any.
    """

    KEY: ClassVar[str] = "v/{vehicle}/remove"
    REPLY: ClassVar[type[Message]] = RemoveReply
    SERVER: ClassVar[str] = "the world"

    vehicle: str
    reason: str = ""
    session: str = ""


MESSAGE = RemoveRequest
