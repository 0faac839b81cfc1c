"""What lens and sensor make of a picture: softness, dark corners, colour, tone.

    light    blur_px: a Gaussian;  vignetting: 1 - share (r / r of the corner)^2
    grey     255 min(1, white_balance grey / 255)^gamma

Noise comes last (`scm.camera.sensor`), in grey levels of the frame. What a car file leaves at its
default costs nothing.
"""

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.optics import Optics


class Look:
    """The look of one camera's frames."""

    def __init__(self, optics: Optics) -> None:
        self._blur_px = optics.blur_px
        self._shade: Image | None = None
        if optics.vignetting:
            light = 1.0 - optics.vignetting * squared_radius(optics.width_px, optics.height_px)
            shade = np.rint(255.0 * light).astype(np.uint8)
            self._shade = np.repeat(shade[:, :, None], 3, axis=2)
        self._tones: Image | None = None
        if optics.gamma != 1.0 or optics.white_balance != (1.0, 1.0, 1.0):
            blue_first = np.array(optics.white_balance[::-1])
            shown = toned(np.arange(256.0)[:, None] * blue_first, optics.gamma)
            self._tones = np.rint(shown).astype(np.uint8)[None]

    def apply(self, frame: Image) -> Image:
        """Return a frame (h, w, 3) as this camera shows it; what it gets may be changed."""
        if self._blur_px:
            frame = np.asarray(cv2.GaussianBlur(frame, (0, 0), self._blur_px), dtype=np.uint8)
        if self._shade is not None:
            cv2.multiply(frame, self._shade, frame, 1.0 / 255.0)
        if self._tones is not None:
            cv2.LUT(frame, self._tones, frame)
        return frame


def squared_radius(width: int, height: int) -> Floats:
    """Return (r / r of the corner)^2 of each pixel, (h, w)."""
    x = (np.arange(width) + 0.5) / width - 0.5
    y = ((np.arange(height) + 0.5) / height - 0.5) * height / width
    squared: Floats = y[:, None] ** 2 + x**2
    return squared / (0.25 + 0.25 * (height / width) ** 2)


def toned(grey: Floats, gamma: float) -> Floats:
    """Return what a tone curve makes of grey levels; those above 255 are white."""
    shown: Floats = 255.0 * np.clip(grey / 255.0, 0.0, 1.0) ** gamma
    return shown
