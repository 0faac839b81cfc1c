"""CAM: a car reports where it is and how it moves."""

from typing import ClassVar

from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.on_air import Received, Sent


class CamTx(Sent[CamBody], kw_only=True, frozen=True, omit_defaults=True):
    """A CAM leaves a station's antenna.

    Attributes:
        signed: Signature in a guarded city, base64 of IEEE 1609.2; empty in others.
    """

    KEY: ClassVar[str] = "v2x/tx/{station}/cam"
    RATE_HZ: ClassVar[float | None] = 10.0

    signed: str = ""


class CamRx(Received[CamBody], kw_only=True, frozen=True, omit_defaults=True):
    """A CAM reaches a station.

    Attributes:
        signed: The sender's signature, see `CamTx`.
        lost_ns: How much time, since the sender came, has passed without its car being moved: the
            computer that simulates it was too slow. This and what follows is by the world, and no
            sender can write it.
        car: The sender's car file, with which it came; empty: it is no car of this city.
        by_hand: Whether somebody else than its own driver or agent holds its lease.
        stopped: Whether the city-wide stop is engaged.
        touches: Whether a wall, a box or another car pushed it within the last half second.
    """

    KEY: ClassVar[str] = "v2x/rx/{receiver}/{station}/cam"
    RATE_HZ: ClassVar[float | None] = 10.0

    signed: str = ""
    lost_ns: int = 0
    car: str = ""
    by_hand: bool = False
    stopped: bool = False
    touches: bool = False


MESSAGES = (CamTx, CamRx)
