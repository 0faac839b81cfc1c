"""Renders the floor: the map's flat picture warped by one homography per strip.

Far away one pixel covers many texels in depth and few across. So the frame is divided into strips
of rows by distance. Each uses a suitable level of an image pyramid; far strips are rendered with
more rows than the frame has, then averaged.
"""

import math
from collections import OrderedDict
from typing import NamedTuple

import cv2
import msgspec
import numpy as np

from scm.arrays import Floats, Image
from scm.camera.daylight import Daylight
from scm.camera.lens import Lens, View
from scm.maps.draw import bounds
from scm.maps.polyline import extent
from scm.maps.route import LanePath
from scm.records.city_map import CityMap, Crosswalk
from scm.scenery.canvas import Colour, colour_of
from scm.scenery.sheet import TABLE, FloorSheet, paint_floor, printed_tag, wall_pieces
from scm.scenery.solids import rectangle
from scm.scenery.tags import PRINT_SCALE

MAX_TEXELS = 14e6
FINEST_TEXELS_PER_M = 1000.0
MAX_PATCHES = 8
LEAST_UPRIGHT = 0.01
"""Of a camera that looks straight up or down the horizon is at this distance."""
ASLANT = 1.3
"""How much farther a frame's corner is than its middle in the same row, for any lens of ours."""
BESIDE_M = 0.3
LEVELS = 6
FINER_IN_DEPTH = 3
SHADE = 0.5
"""What a shadow leaves of the light."""
INVERSE = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP


class Floor:
    """The floor of a city in some light, ready to be seen from anywhere.

    Of a large city only patches around a camera are painted, a fine one and a wide one; they
    are cached for the next cameras there.

    Args:
        city_map: The city.
        daylight: The light on it; shadows of what stands still are painted on.
        seed: Of the floor's grain.
    """

    def __init__(self, city_map: CityMap, daylight: Daylight, seed: int = 0) -> None:
        self._map = city_map
        self._daylight = daylight
        self._seed = seed
        self._paths: dict[str, LanePath] = {}
        self._patches: OrderedDict[tuple[Ring, int, int], Drawing] = OrderedDict()
        self.whole: Drawing | None = None
        if _extent(city_map, FINEST_TEXELS_PER_M)[2] >= FINE.texels_per_m:
            self.whole = whole_floor(city_map, daylight, FINEST_TEXELS_PER_M, seed, self._paths)

    def paint(self, canvas: Image, lens: Lens, view: View, light: float) -> None:
        """Paint what lies below the horizon.

        Args:
            canvas: Of the lens; rows above the horizon are left as they are.
            lens: The camera's.
            view: Where it is.
            light: Factor on the picture: how bright it is times the camera's exposure.
        """
        height, width = canvas.shape[:2]
        horizon = horizon_rows(lens, view, width)
        top = max(0, math.floor(min(horizon)))
        if self.whole is not None:
            self.whole.paint(canvas, lens, view, light, (top, height))
            return
        x, y, high = (float(part) for part in view.position)
        fine, reach = self._patch(FINE, x, y)
        wide, _ = self._patch(WIDE, x, y)
        near = max(horizon) + lens.canvas_matrix[0, 0] * max(high, 1e-3) / (reach / ASLANT)
        split = int(np.clip(near, top, height))
        wide.paint(canvas, lens, view, light, (top, split))
        fine.paint(canvas, lens, view, light, (split, height))

    def _patch(self, ring: "Ring", x: float, y: float) -> tuple["Drawing", float]:
        """Return the patch around a place, and how far it reaches from there in every direction."""
        key = ring, round(x / ring.cell_m), round(y / ring.cell_m)
        at = np.array(key[1:]) * ring.cell_m
        half = ring.size_m / 2
        if key not in self._patches:
            around = _around(self._map, float(at[0]), float(at[1]), ring.size_m)
            corner = (float(at[0]) - half, float(at[1]) + half)
            size = np.array([ring.size_m, ring.size_m])
            beyond = colour_of(self._map.floor.colour)
            self._patches[key] = _drawn(
                around, (corner, size, ring.texels_per_m), beyond, self._daylight, self._seed,
                self._paths,
            )  # fmt: skip
            if len(self._patches) > MAX_PATCHES:
                self._patches.popitem(last=False)
        self._patches.move_to_end(key)
        return self._patches[key], half - float(np.abs(at - (x, y)).max())


Extent = tuple[tuple[float, float], Floats, float]
"""Upper left corner and size of a part of the floor [m], and how fine it is [texels/m]."""


def whole_floor(
    city_map: CityMap, daylight: Daylight, finest: float, seed: int = 0,
    paths: dict[str, LanePath] | None = None,
) -> "Drawing":  # fmt: skip
    """Return the whole floor of a city in one picture, as fine as fits.

    Args:
        city_map: The city.
        daylight: The light on it.
        finest: Most texels per metre.
        seed: Of the floor's grain.
        paths: Its lanes by name, of those that somebody has; the others are added.
    """
    known = {} if paths is None else paths
    return _drawn(city_map, _extent(city_map, finest), TABLE, daylight, seed, known)


def _extent(city_map: CityMap, finest: float) -> Extent:
    x0, y0, x1, y1 = bounds(city_map)
    size = np.array([x1 - x0, y1 - y0]) + 2 * BESIDE_M
    fits = min(finest, math.sqrt(MAX_TEXELS / float(size.prod())))
    return (x0 - BESIDE_M, y1 + BESIDE_M), size, fits


def _drawn(
    city_map: CityMap, extent: Extent, beyond: Colour, daylight: Daylight, seed: int,
    paths: dict[str, LanePath],
) -> "Drawing":  # fmt: skip
    corner, size, texels_per_m = extent
    for lane in city_map.lanes:
        if lane.name not in paths:
            paths[lane.name] = LanePath(lane)
    rng = np.random.default_rng([seed, *b"floor"])
    sheet = FloorSheet(*corner, size, rng, texels_per_m)
    paint_floor(sheet, city_map, paths)
    _lay_tag(sheet, city_map)
    _shade(sheet, city_map, daylight)
    return Drawing(sheet, beyond)


class Ring(NamedTuple):
    """How patches of a large city's floor are laid: one a cell."""

    size_m: float
    cell_m: float
    texels_per_m: float


FINE = Ring(5.0, 1.25, 400.0)
WIDE = Ring(26.0, 4.0, 75.0)


class Drawing:
    """One flat picture of floor at several sizes.

    Attributes:
        corner: Map coordinates of its upper left corner [m].
        texels_per_m: Of the finest.
        levels: The picture, then each half the size of the one before.
        beyond: The colour of what lies outside it.
    """

    def __init__(self, sheet: FloorSheet, beyond: Colour) -> None:
        self.beyond = beyond
        self.corner = (sheet.left, sheet.upper)
        self.texels_per_m = sheet.texels_per_m
        self.levels = [sheet.picture]
        for _ in range(LEVELS - 1):
            self.levels.append(np.asarray(cv2.pyrDown(self.levels[-1]), dtype=np.uint8))
        self._lit: dict[float, list[Image]] = {}

    def paint(
        self, canvas: Image, lens: Lens, view: View, light: float, rows: tuple[int, int]
    ) -> None:
        """Paint some rows of a canvas, from the first to before the second."""
        levels = self._in_light(light)
        beyond = tuple(min(255.0, part * light) for part in self.beyond)
        width = canvas.shape[1]
        # Texels of the finest level to canvas pixels, and back.
        over = np.column_stack((view.camera_R_map[:, :2], -view.camera_R_map @ view.position))
        texel = 1.0 / self.texels_per_m
        placed = np.array([
            [texel, 0.0, self.corner[0] + texel / 2],
            [0.0, -texel, self.corner[1] - texel / 2],
            [0.0, 0.0, 1.0],
        ])  # fmt: skip
        back = np.linalg.inv(lens.canvas_matrix @ over @ placed)
        for top, bottom, level, finer in self._strips(lens, view, rows, width):
            size = (width, (bottom - top) * finer)
            deep = np.array([[1, 0, 0], [0, 1 / finer, top + 0.5 / finer - 0.5], [0, 0, 1.0]])
            # OpenCV halves a picture about its first texel's centre.
            smaller = np.diag([0.5**level, 0.5**level, 1.0])
            strip = cv2.warpPerspective(
                levels[level], smaller @ back @ deep, size, flags=INVERSE,
                borderMode=cv2.BORDER_CONSTANT, borderValue=beyond,
            )  # fmt: skip
            if finer > 1:
                strip = cv2.resize(strip, (width, bottom - top), interpolation=cv2.INTER_AREA)
            canvas[top:bottom] = strip

    def _strips(
        self, lens: Lens, view: View, rows: tuple[int, int], width: int
    ) -> list[tuple[int, int, int, int]]:
        """Return (first row, row after the last, level, how much finer in depth) from below."""
        begin, last = rows
        horizon = max(horizon_rows(lens, view, width))
        f, high = lens.canvas_matrix[0, 0], max(float(view.position[2]), 1e-3)
        strips = []
        for level in range(LEVELS):
            for finer in (1, FINER_IN_DEPTH):
                # Where a pixel covers 1.4 texels of this level, by the mean of both directions.
                texels = 1.4 * 2.0**level / self.texels_per_m
                far = (texels**2 * finer * f * f * high) ** (1 / 3)
                row = max(begin, math.ceil(horizon + f * high / far))
                if level == LEVELS - 1 and finer == FINER_IN_DEPTH:
                    row = begin
                if row < last:
                    strips.append((row, last, level, finer))
                    last = row
        return strips

    def _in_light(self, light: float) -> list[Image]:
        if light == 1.0:
            return self.levels
        if light not in self._lit:
            table = np.clip(np.arange(256) * light, 0.0, 255.0).round().astype(np.uint8)
            self._lit[light] = [np.asarray(cv2.LUT(one, table)) for one in self.levels]
        return self._lit[light]


def _around(city_map: CityMap, x: float, y: float, reach: float) -> CityMap:
    """Return what a map has on its floor within a reach of a place [m], perhaps a little more."""

    def is_near(thing: Crosswalk | tuple[float, float], more: float) -> bool:
        at = thing if isinstance(thing, tuple) else (thing.x_m, thing.y_m)
        return math.hypot(at[0] - x, at[1] - y) < reach + more

    lanes = tuple(
        lane
        for lane in city_map.lanes
        if is_near((lane.start[0], lane.start[1]), sum(extent(one)[0] for one in lane.segments))
    )
    names = {lane.name for lane in lanes}
    return msgspec.structs.replace(
        city_map,
        lanes=lanes,
        stop_lines=tuple(line for line in city_map.stop_lines if line.lane in names),
        crosswalks=tuple(one for one in city_map.crosswalks if is_near(one, one.width_m)),
        walls=tuple(wall for wall in city_map.walls if any(is_near(p, 5.0) for p in wall.points)),
    )


def horizon_rows(lens: Lens, view: View, width: int) -> tuple[float, float]:
    """Return where the horizon crosses the canvas's left and right edge [px]."""
    up = view.camera_R_map[:, 2].copy()  # of the map, in the camera's axes
    k = lens.canvas_matrix
    left, right = ((edge - k[0, 2]) / k[0, 0] for edge in (0.0, width - 1.0))
    if abs(up[1]) < LEAST_UPRIGHT:
        up[1] = -LEAST_UPRIGHT
    rows = [float(k[1, 2] - k[1, 1] * (up[0] * a + up[2]) / up[1]) for a in (left, right)]
    return rows[0], rows[1]


def _lay_tag(sheet: FloorSheet, city_map: CityMap) -> None:
    """Put the map's tag on the floor."""
    tag = city_map.tag
    print_ = printed_tag(tag.tag_id)
    size = tag.size_m * PRINT_SCALE
    corners = rectangle(tag.x_m, tag.y_m, size, size, tag.yaw_rad)
    onto = np.column_stack((corners[:, 0] - sheet.left, sheet.upper - corners[:, 1]))
    onto = onto * sheet.texels_per_m - 0.5
    high, wide = print_.shape[:2]
    edge = np.array([[0, high], [wide, high], [wide, 0], [0, 0]]) - 0.5
    low = np.maximum(np.floor(onto.min(axis=0)).astype(int) - 1, 0)
    top = np.ceil(onto.max(axis=0)).astype(int) + 2
    part = np.ascontiguousarray(sheet.picture[low[1] : top[1], low[0] : top[0]])
    if part.size:
        place = cv2.getPerspectiveTransform(
            edge.astype(np.float32), (onto - low).astype(np.float32)
        )
        shape = (part.shape[1], part.shape[0])
        cv2.warpPerspective(
            print_, place, shape, dst=part, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_TRANSPARENT
        )
        sheet.picture[low[1] : top[1], low[0] : top[0]] = part


def _shade(sheet: FloorSheet, city_map: CityMap, daylight: Daylight) -> None:
    """Darken the floor in the shadows of walls, softly; boxes may move, theirs are not painted."""
    height, width = sheet.picture.shape[:2]
    coarse = 4
    mask = np.zeros((height // coarse + 1, width // coarse + 1), dtype=np.uint8)
    for wall in city_map.walls:
        for foot in wall_pieces(wall):
            top = np.column_stack((foot, np.full(len(foot), wall.height_m)))
            both = np.concatenate((foot, daylight.shadow_of(top))).astype(np.float32)
            hull = cv2.convexHull(both)[:, 0]
            at = np.column_stack((hull[:, 0] - sheet.left, sheet.upper - hull[:, 1]))
            fixed = np.rint(at * sheet.texels_per_m / coarse * 16.0).astype(np.int32)
            cv2.fillConvexPoly(mask, fixed, 255, cv2.LINE_AA, 4)
    if not mask.any():
        return
    reach = 2 * max(1, round(0.008 * sheet.texels_per_m / coarse)) + 1
    soft = cv2.GaussianBlur(mask, (reach, reach), 0.0)
    keep = 1.0 - (1.0 - SHADE) * (1.0 - daylight.ambient) * 1.2 * (soft / 255.0)
    fine = cv2.resize(keep.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
    sheet.lighten(np.asarray(fine, dtype=np.float32))
