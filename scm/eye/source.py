"""The contract of a source of frames: a camera, a file, the bus or the emulated camera."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import cv2
import numpy as np

from scm.arrays import Image
from scm.runtime.part import Subscription
from scm.v2x.exchange import Incoming
from scm.v2x.messages.world_snapshot import WorldSnapshot

Stamped = Literal["exposed", "arrived"]


def grey_of(image: Image) -> Image:
    """Return a picture in grey, (height, width), of one in grey or blue, green, red."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    Attributes:
        t_ns: When it was exposed, as well as the source knows.
        image: (height, width, 3) blue, green, red, or (height, width) grey.
        stamped: What `t_ns` rests on: the camera's own time stamp, or only when the frame arrived.
    """

    t_ns: int
    image: Image
    stamped: Stamped = "exposed"

    def grey(self) -> Image:
        """Return it in grey, (height, width)."""
        return grey_of(self.image)


class Source(Protocol):
    """Where frames come from.

    What cannot work at all is refused when a source is made. From the first `take` on nothing is
    raised any more: a source says its trouble and comes back by itself.
    """

    @property
    def trouble(self) -> str | None:
        """What is wrong now, in words for a person; None: nothing."""
        ...

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest frame not yet taken, None if there is none; times ascend.

        It does not wait for a camera.

        Args:
            now_ns: The present time.
            light: What there is to see, for a source that has no lens of its own.
        """
        ...

    def close(self) -> None:
        """Let go of the camera or file; safe to call twice. Nothing can be taken any more."""
        ...


@runtime_checkable
class Listener(Source, Protocol):
    """A source whose frames come over the bus: its part hears for it."""

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """What the part must hear besides."""
        ...

    def hear(self, item: Incoming) -> None:
        """Look at one thing of the part's inbox; what is not for this source is left alone."""
        ...
