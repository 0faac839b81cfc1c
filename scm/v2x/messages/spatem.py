"""SPATEM: a junction reports its colours and when they change."""

from typing import ClassVar

from scm.v2x.etsi.cam_spatem import SpatemBody
from scm.v2x.on_air import Received, Sent


class SpatemTx(Sent[SpatemBody], kw_only=True, frozen=True):
    """A SPATEM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/spatem"
    RATE_HZ: ClassVar[float | None] = 2.0


class SpatemRx(Received[SpatemBody], kw_only=True, frozen=True):
    """A SPATEM reaches a station."""

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/spatem"
    RATE_HZ: ClassVar[float | None] = 2.0


MESSAGES = (SpatemTx, SpatemRx)
