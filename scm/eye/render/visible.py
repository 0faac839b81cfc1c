"""Computes how much of a print is visible: in the frame, and not covered."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.eye.render.covers import Layer, common
from scm.eye.render.floor import Obstacle
from scm.eye.render.motion import Rect

FINE = 4


@dataclass(frozen=True, slots=True, eq=False)
class Hiding:
    """A painted car, which may hide others.

    Attributes:
        order: Its number in the order of painting; later ones cover earlier ones.
        rect: The window that it and its shadow are in.
        hull: Around its solids, (n, 2) [px].
        outline: Around its wheels on the floor, (k, 2) [m].
    """

    order: int
    rect: Rect
    hull: NDArray[np.float32]
    outline: Floats


def visible_share(
    corners: Floats,
    size_px: tuple[int, int],
    cars: Sequence[Hiding],
    layers: Sequence[Layer],
    obstacles: Sequence[Obstacle] = (),
) -> float:
    """Return the visible share of a print's area, 0 to 1.

    Args:
        corners: Of the whole print, (4, 2) [px].
        size_px: Columns and rows of the frame.
        cars: Those painted over it.
        layers: In front of the whole scene.
        obstacles: In front of it.
    """
    low = np.floor(corners.min(axis=0)).astype(int) - 1
    high = np.ceil(corners.max(axis=0)).astype(int) + 2
    rect = int(low[0]), int(low[1]), int(high[0]), int(high[1])
    shown = _filled(corners, rect)
    whole = float(shown.sum())
    for car in cars:
        if _meet(car.rect, rect):
            shown *= 1.0 - _filled(car.hull, rect)
    for obstacle in obstacles:
        _cut(shown, obstacle.corner, obstacle.mask, rect)
    for layer in layers:
        _cut(shown, layer.corner, layer.solid, rect)
    inside = np.zeros_like(shown)
    (left, top), (right, bottom) = np.maximum(-low, 0), np.maximum(np.array(size_px) - low, 0)
    inside[top:bottom, left:right] = 1.0
    return float((shown * inside).sum()) / whole


def _cut(shown: Floats, corner: tuple[int, int], solid: Floats | Bools, rect: Rect) -> None:
    met = common((*corner, corner[0] + solid.shape[1], corner[1] + solid.shape[0]), rect)
    if met is not None:
        ours, theirs = met
        shown[theirs] *= 1.0 - solid[ours]


def _meet(one: Rect, other: Rect) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _filled(outline: Floats | NDArray[np.float32], rect: Rect) -> Floats:
    """Return the share of each pixel of a window that a convex outline covers, (h, w)."""
    width, height = rect[2] - rect[0], rect[3] - rect[1]
    fine = np.zeros((height * FINE, width * FINE), dtype=np.uint8)
    placed = (outline - np.array(rect[:2]) + 0.5) * FINE - 0.5
    cv2.fillConvexPoly(fine, np.rint(placed * 16.0).astype(np.int32), 255, cv2.LINE_8, 4)
    return (
        np.asarray(
            cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA), dtype=np.float64
        )
        / 255.0
    )
