"""MAPEM: a junction describes its lanes."""

from typing import ClassVar

from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.on_air import Received, Sent


class MapemTx(Sent[MapemBody], kw_only=True, frozen=True):
    """A MAPEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/mapem"
    RATE_HZ: ClassVar[float | None] = 1.0


class MapemRx(Received[MapemBody], kw_only=True, frozen=True):
    """A MAPEM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/mapem"
    RATE_HZ: ClassVar[float | None] = 1.0


MESSAGES = (MapemTx, MapemRx)
