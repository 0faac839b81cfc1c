"""A picture for the Eye to look at: from a camera whose computer is somewhere else, as JPEG."""

from typing import ClassVar

from scm.v2x.message import Message


class EyePictureIn(Message, kw_only=True, frozen=True):
    """One frame as the lens gives it; `payload` is the JPEG file.

    `EyeFrame` is what the Eye shows of its pictures, this is what it is given to look at. The key
    is verbatim at its end: only who subscribes to them by name gets these pictures.

    Attributes:
        t_ns: When it was exposed, on the sender's clock.
        shares_clock: Whether that is the city's clock: the same computer, or one set by NTP or
            PTP. If not, the Eye takes the least delay seen as none.
    """

    KEY: ClassVar[str] = "eye/{camera}/@picture"
    RATE_HZ: ClassVar[float | None] = 30.0

    camera: str
    t_ns: int
    shares_clock: bool = True
    payload: bytes


MESSAGE = EyePictureIn
