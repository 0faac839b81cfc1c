"""SSEM: a junction answers requests for priority."""

from typing import ClassVar

from scm.v2x.etsi.priority import SsemBody
from scm.v2x.on_air import Received, Sent


class SsemTx(Sent[SsemBody], kw_only=True, frozen=True):
    """An SSEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/ssem"
    RATE_HZ: ClassVar[float | None] = 1.0


class SsemRx(Received[SsemBody], kw_only=True, frozen=True):
    """An SSEM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/ssem"
    RATE_HZ: ClassVar[float | None] = 1.0


MESSAGES = (SsemTx, SsemRx)
