"""Measures the sharpness of a tag: the width of the edge from its black square to the margin."""

from typing import NamedTuple

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.eye.detect import CORNER_STD_PX

ALONG = np.linspace(0.2, 0.8, 12)
REACH = 0.11
"""Range to either side of an edge, in sides of the tag: slightly less than one of its cells."""
SAMPLES = 41  # across an edge
TAG_CELLS = 8  # across the black square of a tag of family 36h11
PER_CELL_PX = 0.6
"""Standard deviation of a corner whose edges are as wide as a cell [px]."""


class EdgeWidth(NamedTuple):
    """Width of the step from 20 % to 80 % of it [px], and its height [grey levels]."""

    px: float
    contrast: float


def corner_std_px(width_px: float, side_px: float) -> float:
    """Return the standard deviation of a corner's coordinate by the width of the tag's edges.

    A tag's corners move as blurred edges of neighbouring cells run into one another. Measured on
    rendered tags of 18 to 30 px a side: 0.01 px at edges a fifth of a cell wide, 0.18 px at half a
    cell, by defocus and by motion.
    """
    return max(CORNER_STD_PX, PER_CELL_PX * (width_px * TAG_CELLS / side_px) ** 2)


def edge_width(grey: Image, corners: Floats) -> EdgeWidth:
    """Measure a tag's four outer edges in a grey frame; corners (4, 2) [px].

    An edge without a step, or out of the frame, counts as wide as the range searched.
    """
    ends = np.roll(corners, -1, axis=0)
    along = ends - corners
    side = float(np.hypot(*along.T).mean())
    outward = corners + along / 2.0 - corners.mean(axis=0)
    outward /= np.maximum(np.hypot(*outward.T), 1e-9)[:, None]
    steps = np.linspace(-REACH * side, REACH * side, SAMPLES)
    feet = corners[:, None] + along[:, None] * ALONG[:, None]
    at = feet[:, :, None] + steps[:, None] * outward[:, None, None]
    flat = at.reshape(4, -1, 2).astype(np.float32)
    values = cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR)
    profiles = values.reshape(4, len(ALONG), SAMPLES).mean(axis=1)
    few = SAMPLES // 8
    low, high = profiles[:, :few].mean(axis=1), profiles[:, -few:].mean(axis=1)
    contrast = high - low
    widths = [_rise(one, a, b, steps) for one, a, b in zip(profiles, low, high, strict=True)]
    return EdgeWidth(float(np.median(widths)), float(np.median(contrast)))


def _rise(profile: Floats, low: float, high: float, steps: Floats) -> float:
    whole = float(steps[-1] - steps[0])
    if high - low < 1.0:
        return whole
    share = np.maximum.accumulate((profile - low) / (high - low))
    first, last = np.interp((0.2, 0.8), share, steps)
    return float(last - first)
