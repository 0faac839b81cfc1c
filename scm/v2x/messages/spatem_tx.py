"""On the air, as sent: a junction tells its signal phases."""

from typing import ClassVar

from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.message import Message


class SpatemTx(Message, kw_only=True, frozen=True):
    """A SPATEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/spatem"
    RATE_HZ: ClassVar[float | None] = 2.0

    station: str
    t_ns: int
    body: SpatemBody


MESSAGE = SpatemTx
