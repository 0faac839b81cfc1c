"""Switch a car's headlights and indicators: answered by the car's owner."""

from typing import ClassVar, Literal

from scm.records.fields import VehicleName
from scm.v2x.message import Message, Request


class LightReply(Message, kw_only=True, frozen=True):
    """How the switches stand now; tail, brake and reverse lamps follow by themselves.

    Attributes:
        headlights: How they are switched.
        indicators: How they are switched.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/lights/reply"

    vehicle: VehicleName
    headlights: Literal["off", "low", "high"]
    indicators: Literal["off", "left", "right", "hazard"]


class LightRequest(Request, kw_only=True, frozen=True):
    """Set headlights, indicators or both; None leaves one as it is.

    A leased car refuses this: `DriveCommand` sets them there.
    """

    KEY: ClassVar[str] = "v/{vehicle}/cmd/lights"
    REPLY: ClassVar[type[Message]] = LightReply
    SERVER: ClassVar[str] = "the program that drives {vehicle}"

    vehicle: str
    headlights: Literal["off", "low", "high"] | None = None
    indicators: Literal["off", "left", "right", "hazard"] | None = None


MESSAGE = LightRequest
