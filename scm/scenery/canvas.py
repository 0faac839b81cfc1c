"""A supersampled window of a frame: draw in frame pixels, then blend back with smooth edges."""

from collections.abc import Sequence

import cv2
import numpy as np

from scm.arrays import Floats, Image, Ints

Colour = tuple[int, int, int]
"""Blue, green, red, 0 to 255."""
SHIFT = 4
"""Fraction bits of the vertices handed to OpenCV."""


def colour_of(text: str) -> Colour:
    """Return the colour of `#rrggbb`."""
    red, green, blue = (int(text[i : i + 2], 16) for i in (1, 3, 5))
    return blue, green, red


def dimmed(colour: Colour, gain: float) -> Colour:
    """Return the colour under more (gain above 1) or less light."""
    blue, green, red = (min(255, round(part * gain)) for part in colour)
    return blue, green, red


class Canvas:
    """The part of a frame around some pixels, `scale` times finer.

    Args:
        frame: (height, width, 3); changed by `put_back` only.
        pixels: What must fit into the window, (n, 2) [px].
        margin: Around them [px].
    """

    def __init__(self, frame: Image, pixels: Floats, scale: int = 3, margin: int = 2) -> None:
        low = np.floor(pixels.min(axis=0)).astype(int) - margin
        high = np.ceil(pixels.max(axis=0)).astype(int) + margin + 1
        height, width = frame.shape[:2]
        x0, y0 = max(0, int(low[0])), max(0, int(low[1]))
        x1, y1 = min(width, int(high[0])), min(height, int(high[1]))
        self.is_empty = x1 <= x0 or y1 <= y0
        self.window = frame[y0:y1, x0:x1]
        self.scale = scale
        self.corner = np.array([x0, y0], dtype=np.float64)
        if not self.is_empty and scale > 1:
            size = (x1 - x0) * scale, (y1 - y0) * scale
            self._fine = cv2.resize(self.window, size, interpolation=cv2.INTER_NEAREST)

    def fine(self, pixels: Floats) -> Floats:
        """Return frame pixels as pixels of the fine picture."""
        found: Floats = (pixels - self.corner + 0.5) * self.scale - 0.5
        return found

    def fixed(self, pixels: Floats) -> Ints:
        """Return frame pixels as the fixed-point vertices that `polygon` takes, (n, 2)."""
        return np.rint(self.fine(pixels) * (1 << SHIFT)).astype(np.int32)

    def polygon(self, vertices: Ints, colour: Sequence[float]) -> None:
        """Fill a convex polygon of `fixed` vertices."""
        cv2.fillConvexPoly(self._fine, vertices, colour, cv2.LINE_8, SHIFT)

    def picture(self, picture: Image, corners: Floats) -> None:
        """Paint a picture (h, w, 3) onto four corners, (4, 2) [px].

        Corners: lower left, lower right, upper right, upper left of the picture's outer edge.
        """
        height, width = picture.shape[:2]
        right, bottom = width - 0.5, height - 0.5
        edge = np.array([[-0.5, bottom], [right, bottom], [right, -0.5], [-0.5, -0.5]])
        fine = self.fine(corners)
        low = np.maximum(np.floor(fine.min(axis=0)).astype(int) - 1, 0)
        high = np.ceil(fine.max(axis=0)).astype(int) + 2
        part = self._fine[low[1] : high[1], low[0] : high[0]]
        if part.size == 0:
            return
        onto = cv2.getPerspectiveTransform(edge.astype(np.float32), (fine - low).astype(np.float32))
        painted = np.ascontiguousarray(part)
        cv2.warpPerspective(
            picture,
            onto,
            (part.shape[1], part.shape[0]),
            dst=painted,
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_TRANSPARENT,
        )
        part[:] = painted

    def put_back(self) -> None:
        """Average the fine picture into the frame."""
        height, width = self.window.shape[:2]
        self.window[:] = cv2.resize(self._fine, (width, height), interpolation=cv2.INTER_AREA)
