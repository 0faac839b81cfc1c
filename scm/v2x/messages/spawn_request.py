"""Put a car that the world itself simulates onto the map."""

from typing import ClassVar

from scm.records.fields import XM, YM, TagId, VehicleName, YawRad
from scm.v2x.message import Message, Request


class SpawnReply(Message, kw_only=True, frozen=True):
    """The car stands there; pose of its rear axle in the map frame."""

    KEY: ClassVar[str] = "world/spawn/reply"

    vehicle: VehicleName
    x_m: XM
    y_m: YM
    yaw_rad: YawRad
    tag_id: TagId


class SpawnRequest(Request, kw_only=True, frozen=True):
    """Spawn a hosted car at a named place, at coordinates, or at any free place.

    Attributes:
        vehicle: Its name; empty: the world chooses one.
        car: Car file's name.
        spawn: Name of a spawn place of the map, or `X,Y,DEG`: metres in the map frame and degrees;
            empty: the first free one.
    """

    KEY: ClassVar[str] = "world/spawn"
    REPLY: ClassVar[type[Message]] = SpawnReply
    SERVER: ClassVar[str] = "the world"

    vehicle: str = ""
    car: str = "nigel"
    spawn: str = ""


MESSAGE = SpawnRequest
