"""The tags found in one frame of an overhead camera."""

from typing import ClassVar

import msgspec

from scm.v2x.message import Message

Pixel = tuple[float, float]


class TagSeen(msgspec.Struct, kw_only=True, frozen=True):
    """One tag: centre and corners in pixels of the raw frame, first pixel's centre at (0, 0).

    Attributes:
        corners_px: Lower left, lower right, upper right, upper left of the printed tag.
        margin: Decision margin of the detector.
        hamming: Bits of 36 that were read wrong and corrected; None: not told.
    """

    tag_id: int
    centre_px: Pixel
    corners_px: tuple[Pixel, Pixel, Pixel, Pixel]
    margin: float
    hamming: int | None = None


class EyeTags(Message, kw_only=True, frozen=True):
    """All tags of the frame taken at `t_ns`, which the Eye took up `latency_ms` after exposure."""

    KEY: ClassVar[str] = "eye/{camera}/tags"
    RATE_HZ: ClassVar[float | None] = 10.0

    camera: str
    t_ns: int
    tags: tuple[TagSeen, ...]
    latency_ms: float


MESSAGE = EyeTags
