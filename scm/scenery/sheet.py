"""The floor as one flat picture, seen from above."""

import math
from collections.abc import Mapping
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from scm.arrays import Floats, Image
from scm.geometry import Pose2
from scm.maps.route import LanePath
from scm.records.city_map import CityMap, Crosswalk, Wall
from scm.scenery.canvas import Colour, colour_of, dimmed
from scm.scenery.solids import rectangle
from scm.scenery.tags import tag_picture

TEXELS_PER_M = 800.0
TABLE: Colour = (44, 58, 74)
ASPHALT: Colour = (62, 58, 56)
PAINT: Colour = (222, 226, 228)
CARDBOARD: Colour = (104, 148, 178)
BRICK: Colour = (150, 176, 192)
EDGE_LINE_M = 0.009
BAND = 16  # rows: so many floats stay near the processor
INK, PAPER = 26, 236
"""Grey of a print's black and white."""


class FloorSheet:
    """A picture of the plane of the floor, y up, first the bare table.

    Args:
        left, upper: Map coordinates of its upper left corner [m].
        extent: Its width and height [m].
        rng: Of the floor's grain.
        texels_per_m: How fine it is.

    Attributes:
        picture: (height, width, 3).
    """

    def __init__(
        self,
        left: float,
        upper: float,
        extent: Floats,
        rng: np.random.Generator,
        texels_per_m: float = TEXELS_PER_M,
    ) -> None:
        self.left, self.upper, self.texels_per_m = left, upper, texels_per_m
        width, height = (math.ceil(float(side) * texels_per_m) + 2 for side in extent)
        self.picture: Image = np.empty((height, width, 3), dtype=np.uint8)
        self.picture[0] = TABLE
        self.picture[1:] = self.picture[0]  # to copy rows is much quicker than single texels
        self._rng = rng

    def polygon(self, points: Floats, colour: Colour) -> None:
        """Fill a polygon of map points, (n, 2) [m]."""
        texels = np.column_stack((points[:, 0] - self.left, self.upper - points[:, 1]))
        fixed = np.rint((texels * self.texels_per_m - 0.5) * 16.0).astype(np.int32)
        cv2.fillPoly(self.picture, [fixed], colour, cv2.LINE_AA, 4)

    def grain(self, strengths: tuple[tuple[int, float], ...]) -> None:
        """Roughen everything painted so far: pairs of blotch size [texels] and strength."""
        height, width = self.picture.shape[:2]
        total = np.zeros((height, width), dtype=np.float32)
        blown = np.empty_like(total)
        for size, strength in strengths:
            shape = height // size + 2, width // size + 2
            coarse = self._rng.standard_normal(shape, dtype=np.float32)
            cv2.resize(coarse, (width, height), blown, interpolation=cv2.INTER_CUBIC)
            blown *= np.float32(strength)
            total += blown
        total += 1.0
        self.lighten(total)

    def lighten(self, factors: NDArray[np.float32]) -> None:
        """Multiply every texel by a factor of its own, (height, width)."""
        for top in range(0, len(self.picture), BAND):
            rows = slice(top, top + BAND)
            part = factors[rows]
            lit = self.picture[rows] * cv2.merge((part, part, part))  # twice as quick as to spread
            self.picture[rows] = np.clip(lit, 0.0, 255.0, out=lit)


def paint_floor(
    sheet: FloorSheet, city_map: CityMap, paths: Mapping[str, LanePath] | None = None
) -> None:
    """Paint what lies on a map's floor: plate, roads, crosswalks, stop lines; with its grain.

    Args:
        sheet: Where to.
        city_map: What to paint.
        paths: Its lanes by name, where somebody has them already.
    """
    floor = city_map.floor
    (x0, x1), (y0, y1) = floor.x_m, floor.y_m
    middle = (x0 + x1) / 2, (y0 + y1) / 2
    sheet.polygon(rectangle(*middle, x1 - x0 + 0.016, y1 - y0 + 0.016), dimmed(TABLE, 0.6))
    sheet.polygon(rectangle(*middle, x1 - x0, y1 - y0), colour_of(floor.colour))
    known = paths or {}
    lanes = {lane.name: known.get(lane.name) or LanePath(lane) for lane in city_map.lanes}
    for path in lanes.values():
        sheet.polygon(_strip(path, path.width_m / 2 + EDGE_LINE_M / 2), PAINT)
    for path in lanes.values():
        sheet.polygon(_strip(path, path.width_m / 2 - EDGE_LINE_M / 2), ASPHALT)
    sheet.grain(((2, 0.022), (6, 0.018), (60, 0.02), (300, 0.03)))
    for crosswalk in city_map.crosswalks:
        for stripe in _stripes(crosswalk):
            sheet.polygon(stripe, PAINT)
    for line in city_map.stop_lines:
        path = lanes[line.lane]
        at = path.at(line.at_m)
        bar = rectangle(at.x, at.y, 0.018, path.width_m - EDGE_LINE_M, at.yaw)
        sheet.polygon(bar, PAINT)
    sheet.grain(((3, 0.012),))


def _strip(path: LanePath, half: float) -> Floats:
    left = np.column_stack((-np.sin(path.yaw), np.cos(path.yaw))) * half
    return np.concatenate((path.points + left, (path.points - left)[::-1]))


def _stripes(crosswalk: Crosswalk) -> list[Floats]:
    count = max(2, round(crosswalk.width_m / 0.036))
    pitch = crosswalk.width_m / count
    middle = Pose2(crosswalk.x_m, crosswalk.y_m, crosswalk.yaw_rad)
    stripes = []
    for i in range(count):
        x, y = middle.apply(0.0, (i + 0.5) * pitch - crosswalk.width_m / 2)
        stripes.append(rectangle(x, y, crosswalk.length_m, 0.55 * pitch, crosswalk.yaw_rad))
    return stripes


def printed_tag(tag_id: int, gain: float = 1.0) -> Image:
    """Return the print of a tag under the city's light, (h, w, 3)."""
    paper = tag_picture(tag_id).astype(np.float64) / 255.0
    grey = np.clip((INK + (PAPER - INK) * paper) * gain, 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def wall_pieces(wall: Wall) -> list[Floats]:
    """Return the outlines of a wall's straight pieces, corners filled, (4, 2) each [m]."""
    points = [*wall.points, wall.points[0]] if wall.closed else list(wall.points)
    pieces = []
    for (x0, y0), (x1, y1) in pairwise(points):
        length = math.hypot(x1 - x0, y1 - y0) + wall.thickness_m
        yaw = math.atan2(y1 - y0, x1 - x0)
        pieces.append(rectangle((x0 + x1) / 2, (y0 + y1) / 2, length, wall.thickness_m, yaw))
    return pieces
