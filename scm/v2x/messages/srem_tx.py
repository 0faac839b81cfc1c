"""On the air, as sent: a car asks a junction for priority."""

from typing import ClassVar

from scm.v2x.etsi.priority import SremBody
from scm.v2x.message import Message


class SremTx(Message, kw_only=True, frozen=True):
    """An SREM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/srem"
    RATE_HZ: ClassVar[float | None] = 1.0

    station: str
    t_ns: int
    body: SremBody


MESSAGE = SremTx
