"""Off the air, as heard by one station: a junction tells what becomes of wishes for priority."""

from typing import ClassVar

from scm.v2x.etsi.priority import SsemBody
from scm.v2x.message import Message


class SsemRx(Message, kw_only=True, frozen=True):
    """An SSEM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/ssem"
    RATE_HZ: ClassVar[float | None] = 1.0

    receiver: str
    station: str
    t_ns: int
    body: SsemBody


MESSAGE = SsemRx
