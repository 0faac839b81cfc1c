"""Reserve a parking bay for a car; the parking manager also says when it may drive there."""

from typing import ClassVar

from scm.records.fields import XM, YM, Name, VehicleName, YawRad
from scm.v2x.message import Message, Request


class BayReply(Message, kw_only=True, frozen=True):
    """The bay is the car's while it reports; pose of its rear axle there, map frame.

    The car drives once `ParkingStatus` names it.
    """

    KEY: ClassVar[str] = "parking/bay/reply"

    vehicle: VehicleName
    bay: Name
    x_m: XM
    y_m: YM
    yaw_rad: YawRad


class BayRequest(Request, kw_only=True, frozen=True):
    """Reserve a bay; a car has one at most, so another request changes it.

    Attributes:
        bay: Which one; empty: any free one, or the one that it has.
    """

    KEY: ClassVar[str] = "parking/bay"
    REPLY: ClassVar[type[Message]] = BayReply
    SERVER: ClassVar[str] = "the parking manager"

    vehicle: str
    bay: str = ""


MESSAGE = BayRequest
