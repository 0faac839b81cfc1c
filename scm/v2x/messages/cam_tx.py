"""On the air, as sent: a car tells where it is and how it moves."""

from typing import ClassVar

from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.message import Message


class CamTx(Message, kw_only=True, frozen=True, omit_defaults=True):
    """A CAM leaves a station's antenna.

    Attributes:
        signed: Signature in a guarded city, base64 of IEEE 1609.2; empty in others.
    """

    KEY: ClassVar[str] = "v2x/tx/{station}/cam"
    RATE_HZ: ClassVar[float | None] = 10.0

    station: str
    t_ns: int
    body: CamBody
    signed: str = ""


MESSAGE = CamTx
