"""Off the air, as heard by one station: a junction tells its signal phases."""

from typing import ClassVar

from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.message import Message


class SpatemRx(Message, kw_only=True, frozen=True):
    """A SPATEM reaches a station.

    Attributes:
        receiver: Who hears it.
        station: Who sent it.
        t_ns: When it was sent.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/spatem"
    RATE_HZ: ClassVar[float | None] = 2.0

    receiver: str
    station: str
    t_ns: int
    body: SpatemBody


MESSAGE = SpatemRx
