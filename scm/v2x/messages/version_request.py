"""Request that a car be predicted by another version of its file: the twin part decides by it."""

from typing import ClassVar

from scm.v2x.message import Message, Request
from scm.v2x.messages.twin_status import TwinStatus


class VersionRequest(Request, kw_only=True, frozen=True):
    """Put a version of a car's file in force; an older one takes back those that came after it.

    Attributes:
        version: Its number; 0: the file that the car came with.
        by: Who requests it, and why.
    """

    KEY: ClassVar[str] = "v/{vehicle}/twin/version"
    REPLY: ClassVar[type[Message]] = TwinStatus
    SERVER: ClassVar[str] = "the twin part"

    vehicle: str
    version: int
    by: str
    reason: str = ""


MESSAGE = VersionRequest
