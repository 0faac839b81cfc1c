"""Agree that a car is sent to where it decides whose another's change is."""

from typing import ClassVar

from scm.v2x.message import Message, Request
from scm.v2x.messages.twin_status import TwinStatus


class TwinSendRequest(Request, kw_only=True, frozen=True):
    """Send the car that would decide an undecided change, as soon as it has no other goal.

    Attributes:
        vehicle: Whose change it is.
        send: Which car to send, as the change's `drive` says: what somebody agreed to is done, or
            nothing.
        by: Who agrees, and why.
    """

    KEY: ClassVar[str] = "v/{vehicle}/twin/send"
    REPLY: ClassVar[type[Message]] = TwinStatus
    SERVER: ClassVar[str] = "the twin part"

    vehicle: str
    send: str
    by: str
    reason: str = ""


MESSAGE = TwinSendRequest
