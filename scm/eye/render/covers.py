"""Hands and cables between the camera and the floor: their appearance, and what they hide."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.eye.render.motion import Rect
from scm.scenery.canvas import Colour

FINE = 2
SKINS: tuple[Colour, ...] = ((128, 160, 208), (104, 138, 190), (58, 82, 122), (150, 182, 224))
SLEEVES: tuple[Colour, ...] = ((92, 66, 48), (58, 58, 60), (150, 140, 128), (60, 44, 96))
CABLES: tuple[Colour, ...] = ((30, 30, 32), (122, 74, 36), (44, 44, 150), (60, 62, 64))
SHADE_SHARE = 0.34  # of the light missing under a hand or cable
HAND_M = 0.19
"""From wrist to fingertip."""
CABLE_M = 0.007
REACH_S = 3.0
"""Period of a hand's movement."""
_FINGERS = ((-0.30, 0.84, -0.10), (-0.10, 1.00, -0.03), (0.10, 0.96, 0.03), (0.28, 0.80, 0.12))


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Something in front of the scene, in a window of the frame.

    Attributes:
        corner: First column and row of its window; may lie outside the frame.
        colour: (h, w, 3).
        solid: Share of each pixel that it hides, (h, w), 0 to 1.
        light: Share of the light left by its shadow, (h, w), 0 to 1.
    """

    corner: tuple[int, int]
    colour: Image
    solid: Floats
    light: Floats

    def moved(self, x_px: int, y_px: int) -> "Layer":
        """Return it shifted."""
        corner = self.corner[0] + x_px, self.corner[1] + y_px
        return Layer(corner, self.colour, self.solid, self.light)

    def rect(self) -> Rect:
        """Return left, top, right, bottom of its window."""
        height, width = self.solid.shape
        x, y = self.corner
        return x, y, x + width, y + height

    def over(self, patch: Image, corner: tuple[int, int]) -> None:
        """Paint it over a part of the frame that begins at a column and row; changed in place."""
        height, width = patch.shape[:2]
        met = common(self.rect(), (*corner, corner[0] + width, corner[1] + height))
        if met is None:
            return
        ours, theirs = met
        solid = self.solid[ours][..., None]
        under = patch[theirs] * (self.light[ours][..., None] * (1.0 - solid))
        patch[theirs] = np.rint(under + self.colour[ours] * solid).astype(np.uint8)


def common(one: Rect, other: Rect) -> tuple[tuple[slice, slice], tuple[slice, slice]] | None:
    """Return the intersection of two rectangles, as rows and columns of each; None if empty."""
    left, top = max(one[0], other[0]), max(one[1], other[1])
    right, bottom = min(one[2], other[2]), min(one[3], other[3])
    if right <= left or bottom <= top:
        return None
    first = slice(top - one[1], bottom - one[1]), slice(left - one[0], right - one[0])
    second = slice(top - other[1], bottom - other[1]), slice(left - other[0], right - other[0])
    return first, second


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """An arm that reaches in from an edge and back.

    Attributes:
        layer: With the fingertips at their mean place.
        sway_px: Amplitude of its movement, to the right and to the bottom.
        phase_rad: Phase of its movement at time 0.
    """

    layer: Layer
    sway_px: tuple[float, float]
    phase_rad: float

    def at(self, t_s: float) -> Layer:
        """Return where it is at a time [s]; it moves by whole pixels."""
        reach = math.sin(2.0 * math.pi * t_s / REACH_S + self.phase_rad)
        return self.layer.moved(round(reach * self.sway_px[0]), round(reach * self.sway_px[1]))


def make_hand(
    tip: Floats, inwards_rad: float, px_per_m: float, length_px: float, rng: np.random.Generator
) -> Hand:
    """Draw a hand with its forearm.

    Args:
        tip: Tip of its middle finger, (2,) [px].
        inwards_rad: Its direction, from the picture's right towards its bottom.
        px_per_m: At its height.
        length_px: From the fingertip to where the arm may end out of view.
        rng: Of its colours and motion.
    """
    unit = HAND_M * px_per_m * FINE
    way = np.array([math.cos(inwards_rad), math.sin(inwards_rad)])
    side = np.array([-way[1], way[0]])
    sway = 0.3 * HAND_M * px_per_m * way
    wrist = tip * FINE - unit * way
    elbow = wrist - (length_px * FINE + unit) * way
    skin = SKINS[int(rng.integers(len(SKINS)))]
    sleeve = SLEEVES[int(rng.integers(len(SLEEVES)))]
    ends = np.array([wrist + unit * way, elbow])
    low = np.floor((ends.min(axis=0) - 0.8 * unit) / FINE).astype(int)
    size = np.ceil((ends.max(axis=0) + 0.8 * unit) / FINE).astype(int) - low
    paint = _Paint(low, size)
    cuff = wrist - 0.35 * unit * way
    paint.stroke(elbow, cuff, 0.50 * unit, sleeve)
    paint.stroke(cuff, wrist + 0.1 * unit * way, 0.34 * unit, skin)
    thumb = wrist + 0.22 * unit * way - 0.24 * unit * side
    paint.stroke(thumb, thumb + 0.30 * unit * way - 0.26 * unit * side, 0.15 * unit, skin)
    palm = wrist + 0.16 * unit * way
    for across in (-0.09, 0.09, 0.0):
        start = palm + across * unit * side
        paint.stroke(start, start + 0.26 * unit * way, 0.34 * unit, skin)
    for across, reach, splay in _FINGERS:
        root = wrist + 0.42 * unit * way + 0.62 * across * unit * side
        end = wrist + reach * unit * way + (across * 0.7 + splay) * unit * side
        paint.stroke(root, end, 0.14 * unit, skin)
    layer = paint.layer(shadow_px=0.12 * HAND_M * px_per_m)
    return Hand(layer, (float(sway[0]), float(sway[1])), float(rng.uniform(0.0, 2.0 * math.pi)))


def make_cable(
    start: Floats, end: Floats, px_per_m: float, width: int, height: int, rng: np.random.Generator
) -> Layer:
    """Draw a cable that hangs over the floor from one place to another, (2,) [px] each."""
    t = np.linspace(0.0, 1.0, 120)[:, None]
    along = end - start
    side = np.array([-along[1], along[0]])
    bends = rng.normal(0.0, 0.09, 3)
    wave = sum(bend * np.sin((i + 1) * math.pi * t) for i, bend in enumerate(bends))
    points = (start + t * along + wave * side) * FINE
    colour = CABLES[int(rng.integers(len(CABLES)))]
    paint = _Paint(np.array([0, 0]), np.array([width, height]))
    paint.line(points, CABLE_M * px_per_m * FINE, colour)
    return paint.layer(shadow_px=0.8 * CABLE_M * px_per_m)


class _Paint:
    """A sheet of thick rounded strokes, lighter along their middle."""

    def __init__(self, corner: Floats, size: Floats) -> None:
        self._corner = corner
        height, width = int(size[1]) * FINE, int(size[0]) * FINE
        self._colour: Image = np.zeros((height, width, 3), dtype=np.uint8)
        self._solid: Image = np.zeros((height, width), dtype=np.uint8)

    def stroke(self, start: Floats, end: Floats, thick: float, colour: Colour) -> None:
        """Draw a straight stroke; ends in fine pixels, (2,)."""
        self.line(np.stack((start, end)), thick, colour)

    def line(self, points: Floats, thick: float, colour: Colour) -> None:
        """Draw a bent stroke through points, (n, 2) fine pixels."""
        fixed = np.rint((points - self._corner * FINE) * 16.0).astype(np.int32)[:, None]
        for share, gain in ((1.0, 0.72), (0.86, 0.86), (0.68, 0.96), (0.42, 1.04)):
            width = max(1, round(thick * share))
            tone = tuple(min(255.0, part * gain) for part in colour)
            cv2.polylines(self._colour, [fixed], False, tone, width, cv2.LINE_AA, 4)
        cv2.polylines(self._solid, [fixed], False, 255, max(1, round(thick)), cv2.LINE_AA, 4)

    def layer(self, shadow_px: float) -> Layer:
        """Return the drawing, with a soft shadow offset by [px]."""
        height, width = self._solid.shape[0] // FINE, self._solid.shape[1] // FINE
        full = self._solid > 0
        soft = cv2.GaussianBlur(self._colour, (0, 0), 1.2 * FINE)
        spread = cv2.GaussianBlur(self._solid, (0, 0), 1.2 * FINE)
        blended = soft * (255.0 / np.maximum(spread, 1)[..., None])
        colour = np.where(full[..., None], np.clip(blended, 0.0, 255.0), 0.0).astype(np.uint8)
        small = cv2.resize(colour, (width, height), interpolation=cv2.INTER_AREA)
        hidden = cv2.resize(self._solid, (width, height), interpolation=cv2.INTER_AREA)
        solid = np.asarray(hidden, dtype=np.float64) / 255.0
        # averaging with the empty sheet would darken the rim
        colour = np.clip(small / np.maximum(solid, 1e-3)[..., None], 0.0, 255.0).astype(np.uint8)
        shift = np.array([[1.0, 0.0, 1.3 * shadow_px], [0.0, 1.0, 1.0 * shadow_px]])
        cast = cv2.warpAffine(solid, shift, (width, height))
        soft = cv2.GaussianBlur(cast, (0, 0), max(1.0, 0.7 * shadow_px))
        light = 1.0 - SHADE_SHARE * np.asarray(soft, dtype=np.float64)
        return Layer((int(self._corner[0]), int(self._corner[1])), colour, solid, light)
