"""On the air, as sent: a junction tells what becomes of wishes for priority."""

from typing import ClassVar

from scm.v2x.etsi.priority import SsemBody
from scm.v2x.message import Message


class SsemTx(Message, kw_only=True, frozen=True):
    """An SSEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/ssem"
    RATE_HZ: ClassVar[float | None] = 1.0

    station: str
    t_ns: int
    body: SsemBody


MESSAGE = SsemTx
