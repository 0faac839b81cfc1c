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
    """Convert a picture, grey or blue, green, red, to grey, (height, width)."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    Attributes:
        t_ns: When it was exposed, as far as the source knows.
        image: (height, width, 3) blue, green, red, or (height, width) grey.
        stamped: Origin of `t_ns`: the camera's own time stamp, or only the frame's arrival.
    """

    t_ns: int
    image: Image
    stamped: Stamped = "exposed"

    def grey(self) -> Image:
        """Return it in grey, (height, width)."""
        return grey_of(self.image)


class Source(Protocol):
    """A source of frames.

    What cannot work at all is refused when a source is created. After the first `read` nothing is
    raised any more: a source reports its fault and recovers by itself.
    """

    @property
    def problem(self) -> str | None:
        """What is wrong now, in words; None if nothing is."""
        ...

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest frame not yet read, None if there is none; times ascend.

        It does not wait for a camera.

        Args:
            now_ns: The present time.
            light: What is visible, for a source without a lens of its own.
        """
        ...

    def close(self) -> None:
        """Release the camera or file; safe to call twice. Afterwards nothing can be read."""
        ...


@runtime_checkable
class Listener(Source, Protocol):
    """A source whose frames come over the bus: its part subscribes for it."""

    @property
    def subscriptions(self) -> Sequence[Subscription]:
        """The subscriptions that the part needs for it."""
        ...

    def receive(self, item: Incoming) -> None:
        """Process one item of the part's inbox; unrelated items are ignored."""
        ...
