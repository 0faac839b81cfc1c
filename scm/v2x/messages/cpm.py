"""CPM: a roadside unit reports the cars that its cameras see."""

from typing import ClassVar

from scm.v2x.etsi.cpm import CpmBody
from scm.v2x.on_air import Received, Sent


class CpmTx(Sent[CpmBody], kw_only=True, frozen=True):
    """A CPM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/cpm"
    RATE_HZ: ClassVar[float | None] = 5.0


class CpmRx(Received[CpmBody], kw_only=True, frozen=True):
    """A CPM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/cpm"
    RATE_HZ: ClassVar[float | None] = 5.0


MESSAGES = (CpmTx, CpmRx)
