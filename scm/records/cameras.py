"""Cameras of the city and of cars."""

from typing import Annotated

import msgspec
from msgspec import Meta

from scm.records.fields import CameraNames


class Cameras(msgspec.Struct, kw_only=True, frozen=True):
    """A car's cameras.

    Attributes:
        cameras: Those that its file gives it; may be empty.
        watched: Those whose pictures somebody looks at now.
    """

    cameras: CameraNames
    watched: Annotated[tuple[str, ...], Meta(examples=[["front_camera"]])]
