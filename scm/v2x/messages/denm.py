"""DENM: a station warns of an event."""

from typing import ClassVar

from scm.v2x.etsi.denm import DenmBody
from scm.v2x.on_air import Received, Sent


class DenmTx(Sent[DenmBody], kw_only=True, frozen=True):
    """A DENM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/denm"
    RATE_HZ: ClassVar[float | None] = 1.0


class DenmRx(Received[DenmBody], kw_only=True, frozen=True):
    """A DENM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/denm"
    RATE_HZ: ClassVar[float | None] = 1.0


MESSAGES = (DenmTx, DenmRx)
