"""Paints faces onto a canvas, farthest object first, clipped at the near plane."""

from typing import NamedTuple

import cv2
import numpy as np

from scm.arrays import Bools, Floats, Image, Ints
from scm.camera.daylight import Daylight
from scm.camera.lens import Lens, View
from scm.camera.mesh import Mesh
from scm.scenery.canvas import SHIFT

NEAREST_M = 0.02
FARTHEST_PX = 1.0e4
"""Corners farther out are pulled in: OpenCV counts in 32 bits, 4 of them fractions."""
HALO = 0.55
MAX_HALO_PX = 120.0


class Thing(NamedTuple):
    """A mesh in the map.

    Attributes:
        mesh: Its faces.
        rotation: map_R_thing, (3, 3).
        origin: Where it stands, (3,) [m].
        middle: What its distance is measured from, (3,) [m].
        radius: Of a ball around `middle` that holds all of it [m].
    """

    mesh: Mesh
    rotation: Floats
    origin: Floats
    middle: Floats
    radius: float


class Painter:
    """Paints through one lens in one light.

    Args:
        lens: The camera's.
        daylight: The light on faces.
        exposure: Factor on all light, gain included.
    """

    def __init__(self, lens: Lens, daylight: Daylight, exposure: float) -> None:
        self._lens = lens
        self._daylight = daylight
        self._exposure = exposure
        width, height = lens.canvas_size
        k = lens.canvas_matrix
        self._reach = np.array([
            max(k[0, 2], width - k[0, 2]) / k[0, 0], max(k[1, 2], height - k[1, 2]) / k[1, 1]
        ])  # fmt: skip
        y, x = np.mgrid[-1.0:1.0:65j, -1.0:1.0:65j]
        fall = np.clip(1.0 - np.hypot(x, y), 0.0, 1.0) ** 2
        self._halo = np.rint(255.0 * fall).astype(np.uint8)

    def visible(self, view: View, middles: Floats, radii: Floats) -> Bools:
        """Return of which balls any part can be in the picture, (n, 3) and (n,) [m] to (n,)."""
        x, y, z = view.seen(middles).T
        a, b = self._reach
        wide, high = (1.0 + a * a) ** 0.5, (1.0 + b * b) ** 0.5
        across = (np.abs(x) < a * z + radii * wide) & (np.abs(y) < b * z + radii * high)
        found: Bools = across & (z > NEAREST_M - radii)
        return found

    def sees(self, view: View, middle: Floats, radius: float) -> bool:
        """Return whether any of a ball can be in the picture."""
        return bool(self.visible(view, middle[None], np.array([radius]))[0])

    def paint(self, canvas: Image, view: View, things: list[Thing]) -> None:
        """Paint things, the farthest first."""
        seen = self.seen(view, things)
        seen.sort(key=lambda thing: -float(np.linalg.norm(thing.middle - view.position)))
        for thing in seen:
            self._paint_thing(canvas, view, thing)

    def seen(self, view: View, things: list[Thing]) -> list[Thing]:
        """Return the things of which any part can be in the picture."""
        if not things:
            return []
        middles = np.array([thing.middle for thing in things])
        radii = np.array([thing.radius for thing in things])
        found = np.flatnonzero(self.visible(view, middles, radii))
        return [things[i] for i in found]

    def shade(self, canvas: Image, view: View, outline: Floats, keep: float) -> None:
        """Leave a share of the light on a convex part of the floor, (n, 2) [m], softly."""
        corners = view.seen(np.column_stack((outline, np.zeros(len(outline)))))
        polygon = self._on_canvas(_in_front(corners))
        height, width = canvas.shape[:2]
        if len(polygon) < 3:
            return
        soft = 3 + 2 * int(np.clip(np.ptp(polygon[:, 0]) / 60.0, 0, 8))
        low = np.maximum(np.floor(polygon.min(axis=0)).astype(int) - soft, 0)
        high = np.minimum(np.ceil(polygon.max(axis=0)).astype(int) + soft, (width, height))
        if (high <= low).any():
            return
        mask = np.full((high[1] - low[1], high[0] - low[0]), 255, dtype=np.uint8)
        cv2.fillConvexPoly(mask, _fixed(polygon - low), round(255 * keep), cv2.LINE_AA, SHIFT)
        mask = np.asarray(cv2.blur(mask, (soft, soft)), dtype=np.uint8)
        part = canvas[low[1] : high[1], low[0] : high[0]]
        part[:] = cv2.multiply(part, cv2.cvtColor(mask, cv2.COLOR_GRAY2BGR), scale=1.0 / 255.0)

    def _paint_thing(self, canvas: Image, view: View, thing: Thing) -> None:
        mesh = thing.mesh
        points, normals = mesh.placed(thing.rotation, thing.origin)
        starts = mesh.starts[:-1]
        faces_us = ((view.position - points[starts]) * normals).sum(axis=1) > 0.0
        corners = view.seen(points)
        nearest = np.minimum.reduceat(corners[:, 2], starts)
        farthest = np.maximum.reduceat(corners[:, 2], starts)
        shown: Bools = faces_us & (farthest > NEAREST_M)
        if not shown.any():
            return
        colours = self._colours(mesh, normals)
        before_lens = np.maximum(corners, (-np.inf, -np.inf, NEAREST_M))
        fixed = _fixed(self._on_canvas(before_lens))
        eye = (view.position - thing.origin) @ thing.rotation
        for part in mesh.order(eye):
            first, last = mesh.parts[part]
            for face in range(first, last):
                if not shown[face]:
                    continue
                here = slice(mesh.starts[face], mesh.starts[face + 1])
                ring = fixed[here]
                if nearest[face] < NEAREST_M:
                    ring = _fixed(self._on_canvas(_in_front(corners[here])))
                self._fill(canvas, ring, colours[face], mesh.shines[face])

    def _colours(self, mesh: Mesh, normals: Floats) -> list[list[float]]:
        light = np.where(mesh.shines > 0.0, 1.0, self._daylight.on_faces(normals))
        lit = mesh.colours * (light * self._exposure)[:, None]
        shown: list[list[float]] = lit.clip(0.0, 255.0).tolist()
        return shown

    def _on_canvas(self, corners: Floats) -> Floats:
        return np.clip(self._lens.on_canvas(corners), -FARTHEST_PX, FARTHEST_PX)

    def _fill(self, canvas: Image, ring: Ints, colour: list[float], shines: float) -> None:
        if shines > 0.0:
            self._glow(canvas, ring, colour, shines)
        cv2.fillConvexPoly(canvas, ring, colour, cv2.LINE_AA, SHIFT)

    def _glow(self, canvas: Image, ring: Ints, colour: list[float], wide: float) -> None:
        middle = ring.mean(axis=0) / (1 << SHIFT)
        reach = min(MAX_HALO_PX, wide * float(np.ptp(ring, axis=0).max()) / (2 << SHIFT))
        low = np.floor(middle - reach).astype(int)
        size = int(2 * reach) + 1
        height, width = canvas.shape[:2]
        x0, y0 = max(0, low[0]), max(0, low[1])
        x1, y1 = min(width, low[0] + size), min(height, low[1] + size)
        if size < 3 or x1 <= x0 or y1 <= y0:
            return
        fall = cv2.resize(self._halo, (size, size), interpolation=cv2.INTER_AREA)
        part = fall[y0 - low[1] : y1 - low[1], x0 - low[0] : x1 - low[0]]
        light = cv2.merge([cv2.convertScaleAbs(part, alpha=HALO * c / 255.0) for c in colour])
        window = canvas[y0:y1, x0:x1]
        window[:] = cv2.add(window, light)


def _in_front(ring: Floats) -> Floats:
    """Return the part of a polygon in the camera's frame, (n, 3), that lies before the lens."""
    corners_in_front = []
    for here, there in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        if here[2] >= NEAREST_M:
            corners_in_front.append(here)
        if (here[2] >= NEAREST_M) != (there[2] >= NEAREST_M):
            share = (NEAREST_M - here[2]) / (there[2] - here[2])
            corners_in_front.append(here + share * (there - here))
    return np.array(corners_in_front).reshape(-1, 3)


def _fixed(ring: Floats) -> Ints:
    fixed: Ints = np.rint(ring * (1 << SHIFT)).astype(np.int32)
    return fixed
