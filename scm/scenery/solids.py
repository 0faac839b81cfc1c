"""Prisms and frustums seen through the lens: visible sides shaded by the light, then the top."""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats, Ints
from scm.scenery.canvas import Canvas, Colour

LIGHT = np.array([math.cos(2.2), math.sin(2.2)])
"""Where the lamp hangs, as a direction over the floor."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A convex outline at two heights, counter-clockwise from above; (n, 3) each [m]."""

    bottom: Floats
    top: Floats
    colour: Colour


def prism(outline: Floats, low: float, high: float, colour: Colour, taper: float = 0.0) -> Solid:
    """Raise an outline (n, 2) from height to height; its top is `taper` smaller."""
    middle = outline.mean(axis=0)
    shrunk = middle + (outline - middle) * (1.0 - taper)
    return Solid(_at_height(outline, low), _at_height(shrunk, high), colour)


def rectangle(x: float, y: float, length: float, width: float, yaw: float = 0.0) -> Floats:
    """Return the outline of a rectangle around a middle, (4, 2)."""
    c, s = math.cos(yaw), math.sin(yaw)
    half = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * (length / 2, width / 2)
    turned: Floats = half @ np.array([[c, s], [-s, c]]) + (x, y)
    return turned


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Several solids as arrays, first at the back.

    Attributes:
        points: All corners, bottoms then tops, (2 n, 3) [m].
        following: Which bottom corner comes next around its ring, (n,).
        rings: Start and stop of each solid's corners.
        colours: Of the solid that a corner belongs to, (n, 3).
    """

    points: Floats
    following: Ints
    rings: tuple[tuple[int, int], ...]
    colours: Floats

    def placed(self, rotation: Floats, origin: Floats) -> "Shape":
        """Return the shape of a body frame in the map frame."""
        points = self.points @ rotation.T + origin
        return Shape(points, self.following, self.rings, self.colours)


def shape_of(solids: tuple[Solid, ...]) -> Shape:
    """Join solids that are drawn together, first at the back."""
    counts = [len(one.bottom) for one in solids]
    stops = np.cumsum(counts)
    rings = tuple((int(b - n), int(b)) for n, b in zip(counts, stops, strict=True))
    following = [a + (np.arange(b - a) + 1) % (b - a) for a, b in rings]
    return Shape(
        np.concatenate([one.bottom for one in solids] + [one.top for one in solids]),
        np.concatenate(following),
        rings,
        np.repeat([one.colour for one in solids], counts, axis=0).astype(np.float64),
    )


def draw_shape(canvas: Canvas, shape: Shape, pixels: Floats, gain: float = 1.0) -> None:
    """Paint a shape.

    Args:
        canvas: Where to.
        shape: In the map frame.
        pixels: Its points through the lens, (2 n, 2).
        gain: Brightness of the light there.
    """
    count = len(shape.colours)
    vertices = canvas.fixed(pixels)
    here, there = np.arange(count), shape.following
    quads = vertices[np.stack((here, there, there + count, here + count), axis=1)]
    low, high = pixels[:count], pixels[count:]
    across, along = high[there] - low, high - low[there]
    faces_us = across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0] < 0.0
    edge = shape.points[there, :2] - shape.points[:count, :2]
    outward = np.stack((edge[:, 1], -edge[:, 0]), axis=1)
    lit = outward @ LIGHT / np.maximum(np.hypot(outward[:, 0], outward[:, 1]), 1e-9)
    sides = np.rint(shape.colours * gain * (0.55 + 0.2 * lit)[:, None]).clip(0, 255).tolist()
    tops = np.rint(shape.colours * gain).clip(0, 255).tolist()
    for start, stop in shape.rings:
        for i in range(start, stop):
            if faces_us[i]:
                canvas.polygon(quads[i], sides[i])
        canvas.polygon(vertices[count + start : count + stop], tops[start])


def _at_height(outline: Floats, height: float) -> Floats:
    return np.column_stack((outline, np.full(len(outline), height)))
