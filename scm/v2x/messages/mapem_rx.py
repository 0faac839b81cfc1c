"""Off the air, as heard by one station: a junction tells its lanes."""

from typing import ClassVar

from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.message import Message


class MapemRx(Message, kw_only=True, frozen=True):
    """A MAPEM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/mapem"
    RATE_HZ: ClassVar[float | None] = 1.0

    receiver: str
    station: str
    t_ns: int
    body: MapemBody


MESSAGE = MapemRx
