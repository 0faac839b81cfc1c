"""A picture of a car's own camera, as JPEG; sent only while somebody subscribes to it by name."""

from typing import ClassVar

from scm.v2x.message import Message


class CameraFrame(Message, kw_only=True, frozen=True):
    """One frame as the lens gives it, distortion and noise included; `payload` is the JPEG file.

    Attributes:
        camera: `front` or `rear`.
        t_ns: When it was exposed.
    """

    KEY: ClassVar[str] = "v/{vehicle}/@camera/{camera}"
    RATE_HZ: ClassVar[float | None] = 15.0

    vehicle: str
    camera: str
    t_ns: int
    width_px: int
    height_px: int
    payload: bytes


MESSAGE = CameraFrame
