"""The contract of a source of frames: a camera, a file, or the emulated overhead camera."""

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from scm.arrays import Image
from scm.v2x.messages.world_snapshot import WorldSnapshot


def grey_of(image: Image) -> Image:
    """Return a picture in grey, (height, width), of one in grey or blue, green, red."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    Attributes:
        t_ns: When it was exposed.
        image: (height, width, 3) blue, green, red, or (height, width) grey.
    """

    t_ns: int
    image: Image

    def grey(self) -> Image:
        """Return it in grey, (height, width)."""
        return grey_of(self.image)


class Source(Protocol):
    """Where frames come from."""

    def take(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the newest frame not yet taken, None if there is none.

        Args:
            now_ns: The present time.
            light: What there is to see, for a source that has no lens of its own.
        """
        ...
