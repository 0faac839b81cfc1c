"""A picture of an overhead camera for people, as JPEG: what was found is drawn over it."""

from typing import ClassVar

from scm.v2x.message import Message


class EyePreview(Message, kw_only=True, frozen=True):
    """One frame with its tags outlined and named, and the camera's faults below.

    Made only while somebody subscribes to it by name. `EyeFrame` is the bare picture.
    """

    KEY: ClassVar[str] = "eye/{camera}/@preview"
    RATE_HZ: ClassVar[float | None] = 5.0

    camera: str
    t_ns: int
    width_px: int
    height_px: int
    payload: bytes


MESSAGE = EyePreview
