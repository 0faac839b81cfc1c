"""On the air, as sent: a junction tells its lanes."""

from typing import ClassVar

from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.message import Message


class MapemTx(Message, kw_only=True, frozen=True):
    """A MAPEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/mapem"
    RATE_HZ: ClassVar[float | None] = 1.0

    station: str
    t_ns: int
    body: MapemBody


MESSAGE = MapemTx
