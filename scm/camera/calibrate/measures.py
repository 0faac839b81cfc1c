"""What can be measured of frames whose poses nobody knows: colour, noise, sharpness.

Noise is what a Laplacian of a Laplacian leaves where the picture is even, by grey level; a floor's
fine texture is in it. Sharpness is how much steeper edges are than in a blurred picture. Both are
affected by JPEG: compare frames of one compression.
"""

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats, Image

Light = NDArray[np.float32]
SHARES = np.linspace(0.02, 0.98, 49)
BIN = 16.0
"""Of grey levels among which noise is equal."""
BINS = 15  # the last one is too near white: noise is cut off there
LEAST_PIXELS = 300
EVEN = 0.5
"""Share of a frame whose pixels are even enough to see noise in."""
TRIMMED = 0.97
_KERNEL = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6.0
_FINE_PX, _COARSE_PX = 1.0, 4.0
_EDGES = 0.01  # of the pixels
_AROUND = np.ones((9, 9), np.uint8)


def colours(images: Image, zones: Floats, count: int) -> Floats:
    """Return quantiles of red, green and blue by zone, (count, shares, 3).

    Args:
        images: (n, h, w, 3), blue first.
        zones: The number of each pixel's zone, (h, w).
        count: Of zones.
    """
    found = [np.quantile(images[:, zones == i], SHARES, axis=(0, 1)) for i in range(count)]
    quantiles: Floats = np.stack(found)[..., ::-1]
    return quantiles


def colour_distance(one: Image, other: Image) -> float:
    """Return by how many grey levels the colours of two sets of small frames differ.

    It is the mean distance of their quantiles: how far grey levels must be moved.
    """
    everywhere = np.zeros(one.shape[1:3])
    return float(np.abs(colours(one, everywhere, 1) - colours(other, everywhere, 1)).mean())


def noise(images: Iterable[Image]) -> tuple[Floats, Floats]:
    """Return the standard deviation of noise by grey level, and of how many pixels; (BINS,) each.

    A level that hardly any pixel has is NaN.
    """
    found = [list[Floats]() for _ in range(BINS)]
    for image in images:
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float32)
        left = cv2.filter2D(grey, cv2.CV_32F, _KERNEL)
        smooth = cv2.GaussianBlur(grey, (0, 0), 2.0)
        steep = cv2.magnitude(*(cv2.Sobel(smooth, cv2.CV_32F, *way) for way in ((1, 0), (0, 1))))
        level = (smooth / BIN).astype(int)
        level[steep > np.quantile(steep, EVEN)] = -1
        for i in range(BINS):
            found[i].append(np.abs(left[level == i]).astype(np.float64))
    sigma, pixels = np.full(BINS, np.nan), np.zeros(BINS)
    for i, parts in enumerate(found):
        values = np.concatenate(parts) if parts else np.empty(0)
        pixels[i] = len(values)
        if len(values) >= LEAST_PIXELS:
            inner = values[values <= np.quantile(values, TRIMMED)]
            sigma[i] = float(np.sqrt(np.mean(inner**2)))
    return sigma, pixels


def sharpness(images: Iterable[Image]) -> float:
    """Return how many times steeper edges are than blurred by 4 px, median; 0 without edges."""
    ratios = list[Floats]()
    for image in images:
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float32)
        fine, coarse = (_steepness(grey, px) for px in (_FINE_PX, _COARSE_PX))
        edges = coarse >= max(1.0, float(np.quantile(coarse, 1.0 - _EDGES)))
        ratios.append((cv2.dilate(fine, _AROUND)[edges] / coarse[edges]).astype(np.float64))
    every = np.concatenate(ratios) if ratios else np.empty(0)
    return float(np.median(every)) if every.size else 0.0


def _steepness(grey: Light, blurred_px: float) -> Light:
    smooth = cv2.GaussianBlur(grey, (0, 0), blurred_px)
    across, down = (cv2.Sobel(smooth, cv2.CV_32F, *way) for way in ((1, 0), (0, 1)))
    return np.asarray(cv2.magnitude(across, down), dtype=np.float32)
