"""On the air, as sent: a car tells where it is and how it moves."""

from typing import ClassVar

from scm.v2x.etsi import CamBody
from scm.v2x.message import Message


class CamTx(Message, kw_only=True, frozen=True):
    """A CAM leaves a station's antenna."""

    KEY: ClassVar[str] = "v2x/tx/{station}/cam"
    RATE_HZ: ClassVar[float | None] = 10.0

    station: str
    t_ns: int
    body: CamBody


MESSAGE = CamTx
