"""Off the air, as heard by one station: a station warns of an event."""

from typing import ClassVar

from scm.v2x.etsi.denm import DenmBody
from scm.v2x.message import Message


class DenmRx(Message, kw_only=True, frozen=True):
    """A DENM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/denm"
    RATE_HZ: ClassVar[float | None] = 1.0

    receiver: str
    station: str
    t_ns: int
    body: DenmBody


MESSAGE = DenmRx
