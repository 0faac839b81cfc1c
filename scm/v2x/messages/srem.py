"""SREM: a car requests priority of a junction."""

from typing import ClassVar

from scm.v2x.etsi.priority import SremBody
from scm.v2x.on_air import Received, Sent


class SremTx(Sent[SremBody], kw_only=True, frozen=True):
    """An SREM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/srem"
    RATE_HZ: ClassVar[float | None] = 1.0


class SremRx(Received[SremBody], kw_only=True, frozen=True):
    """An SREM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/srem"
    RATE_HZ: ClassVar[float | None] = 1.0


MESSAGES = (SremTx, SremRx)
