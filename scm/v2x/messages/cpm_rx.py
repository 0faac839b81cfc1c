"""Off the air, as heard by one station: a roadside unit tells which cars its cameras see."""

from typing import ClassVar

from scm.v2x.etsi.cpm import CpmBody
from scm.v2x.message import Message


class CpmRx(Message, kw_only=True, frozen=True):
    """A CPM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/cpm"
    RATE_HZ: ClassVar[float | None] = 5.0

    receiver: str
    station: str
    t_ns: int
    body: CpmBody


MESSAGE = CpmRx
