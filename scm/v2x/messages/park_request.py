"""Send a car to a parking place: the agent that drives it finds the way itself."""

from typing import ClassVar

from scm.records.fields import XM, YM, VehicleName, YawRad
from scm.v2x.message import Message, Request


class ParkReply(Message, kw_only=True, frozen=True):
    """Where the car is about to park: pose of its rear axle, map frame."""

    KEY: ClassVar[str] = "v/{vehicle}/park/reply"

    vehicle: VehicleName
    x_m: XM
    y_m: YM
    yaw_rad: YawRad


class ParkRequest(Request, kw_only=True, frozen=True):
    """Park at a goal; a car on its way to another one turns to the new one.

    Attributes:
        goal: Name of a spawn place or bay of the map, or `X,Y,DEG`: metres in the map frame and
            degrees. A bay, or `any` of them, is requested from the parking manager.
    """

    KEY: ClassVar[str] = "v/{vehicle}/park"
    REPLY: ClassVar[type[Message]] = ParkReply
    SERVER: ClassVar[str] = "the agent that parks {vehicle}"

    vehicle: str
    goal: str


MESSAGE = ParkRequest
