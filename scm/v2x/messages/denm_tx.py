"""On the air, as sent: a station warns of an event."""

from typing import ClassVar

from scm.v2x.etsi.denm import DenmBody
from scm.v2x.message import Message


class DenmTx(Message, kw_only=True, frozen=True):
    """A DENM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/denm"
    RATE_HZ: ClassVar[float | None] = 1.0

    station: str
    t_ns: int
    body: DenmBody


MESSAGE = DenmTx
