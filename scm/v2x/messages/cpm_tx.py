"""On the air, as sent: a roadside unit tells which cars its cameras see."""

from typing import ClassVar

from scm.v2x.etsi.cpm import CpmBody
from scm.v2x.message import Message


class CpmTx(Message, kw_only=True, frozen=True):
    """A CPM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/cpm"
    RATE_HZ: ClassVar[float | None] = 5.0

    station: str
    t_ns: int
    body: CpmBody


MESSAGE = CpmTx
