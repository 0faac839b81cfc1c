"""A picture of an overhead camera, as JPEG."""

from typing import ClassVar

from scm.v2x.message import Message


class EyeFrame(Message, kw_only=True, frozen=True):
    """One frame, undistorted neither nor cropped; `payload` is the JPEG file."""

    KEY: ClassVar[str] = "eye/{camera}/frame"
    RATE_HZ: ClassVar[float | None] = 5.0

    camera: str
    t_ns: int
    width_px: int
    height_px: int
    payload: bytes


MESSAGE = EyeFrame
