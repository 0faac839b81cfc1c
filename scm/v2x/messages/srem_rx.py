"""Off the air, as heard by one station: a car asks a junction for priority."""

from typing import ClassVar

from scm.v2x.etsi.priority import SremBody
from scm.v2x.message import Message


class SremRx(Message, kw_only=True, frozen=True):
    """An SREM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/srem"
    RATE_HZ: ClassVar[float | None] = 1.0

    receiver: str
    station: str
    t_ns: int
    body: SremBody


MESSAGE = SremRx
