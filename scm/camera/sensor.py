"""The image sensor: shot noise that grows with the light, and constant read noise.

    sigma(s) = sqrt(gain) sqrt(gain read^2 + shot^2 s / 255)      s: grey level, 0 to 255

With twice the light and half the gain a picture looks the same with less noise. The noise is cut
from a random place of a sheet that is drawn once, since fresh noise would cost more than all the
rest. The place is a function of seed, car, camera and time alone.
"""

import hashlib

import cv2
import numpy as np

from scm.arrays import Image
from scm.camera.optics import Optics

SHEET_ROWS = 160
STRIP_ROWS = 64
_FINE = 64


class Noise:
    """The noise of cameras of one kind.

    Args:
        optics: Its strength, and the frame's size.
        seed: Of the run.
    """

    def __init__(self, optics: Optics, seed: int) -> None:
        levels = np.arange(256)
        gain = optics.gain
        variance = gain * (gain * optics.read_noise**2 + optics.shot_noise**2 * levels / 255.0)
        self.is_silent = not variance.any()
        self._seed = seed
        self._sigma = np.rint(np.sqrt(variance) * _FINE).astype(np.int16)
        rng = np.random.default_rng([seed, *b"camera"])
        self._row = 3 * optics.width_px
        count = self._row * (optics.height_px + SHEET_ROWS)
        drawn = rng.standard_normal(count if not self.is_silent else 0, dtype=np.float32)
        self._sheet = np.clip(np.rint(drawn * _FINE), -32000, 32000).astype(np.int16)

    def add(self, frame: Image, vehicle: str, camera: str, t_ns: int) -> None:
        """Make a frame (h, w, 3) noisy."""
        if self.is_silent:
            return
        digest = hashlib.blake2s(f"{self._seed}/{vehicle}/{camera}/{t_ns}".encode()).digest()
        start = int.from_bytes(digest[:8], "little") % (self._row * SHEET_ROWS)
        for top in range(0, frame.shape[0], STRIP_ROWS):  # small enough for the nearest cache
            strip = frame[top : top + STRIP_ROWS]
            begin = start + top * self._row
            drawn = self._sheet[begin : begin + strip.size].reshape(strip.shape)
            sigma = cv2.LUT(strip, self._sigma)
            noise = cv2.multiply(sigma, drawn, scale=1.0 / _FINE**2)
            cv2.add(strip, noise, strip, dtype=cv2.CV_8U)
