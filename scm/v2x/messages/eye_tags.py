"""The tags found in one frame of an overhead camera."""

from typing import ClassVar

from scm.records.eye import TagSeen
from scm.records.fields import CameraName, LatencyMs, TNs
from scm.v2x.message import Message


class EyeTags(Message, kw_only=True, frozen=True):
    """All tags of the frame taken at `t_ns`, which the Eye took up `latency_ms` after exposure."""

    KEY: ClassVar[str] = "eye/{camera}/tags"
    RATE_HZ: ClassVar[float | None] = 10.0

    camera: CameraName
    t_ns: TNs
    tags: tuple[TagSeen, ...]
    latency_ms: LatencyMs


MESSAGE = EyeTags
