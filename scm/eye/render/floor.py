"""Static scenery, drawn once: ground, roads, paint, the map's tag, obstacles."""

from dataclasses import dataclass

import cv2
import numpy as np

from scm.arrays import Bools, Floats, Image
from scm.eye.camera import CameraModel
from scm.geometry import Pose2
from scm.records.city_map import Box, CityMap, MapTag
from scm.scenery.canvas import Canvas
from scm.scenery.sheet import BRICK, CARDBOARD, FloorSheet, paint_floor, printed_tag, wall_pieces
from scm.scenery.solids import Solid, draw_shape, prism, rectangle, shape_of
from scm.scenery.tags import PRINT_SCALE, tag_corners

FINER = 2
GRID_PX = 8
STRIP_PX = 128
AROUND_M = 3.0
"""Width of the surroundings drawn around a map's floor."""
LEAST_FALL = 0.02
"""Rays that sink less than this per length of 1 ahead are not traced to the floor."""
LOW_M = 0.1
"""Lower obstacles hide no roof."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """Something that stands on the floor and may hide a car behind it.

    Attributes:
        foot: Its outline on the floor, counter-clockwise, (n, 2) [m].
        corner: First column and row of its window in the frame.
        mask: Which pixels of the window it covers.
    """

    foot: Floats
    corner: tuple[int, int]
    mask: Bools

    def is_before(self, points: Floats, eye: Floats) -> bool:
        """Return whether a line over the floor from `eye` (2,) to one of `points` (n, 2) meets it.

        That is whether, seen from a camera above `eye`, it stands in front of something there.
        """
        edge = np.roll(self.foot, -1, axis=0) - self.foot
        line = (points - eye)[:, None]
        across = _cross(line, edge)
        safe = np.where(across == 0.0, np.inf, across)
        from_eye = self.foot - eye
        along_line = _cross(from_eye, edge) / safe
        along_edge = _cross(from_eye, line) / safe
        met = (along_line >= 0.0) & (along_line <= 1.0) & (along_edge >= 0.0) & (along_edge <= 1.0)
        return bool((met & (across != 0.0)).any())


@dataclass(frozen=True, slots=True, eq=False)
class Scenery:
    """The static picture, and its obstacles.

    Attributes:
        picture: (height, width, 3).
        light: Brightness of the light at each pixel, about 1, (height, width).
        obstacles: Walls and boxes.
    """

    picture: Image
    light: Floats
    obstacles: tuple[Obstacle, ...]


def _cross(a: Floats, b: Floats) -> Floats:
    found: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return found


def draw_scenery(city_map: CityMap, model: CameraModel, rng: np.random.Generator) -> Scenery:
    """Draw the empty city through the lens."""
    camera = model.camera
    picture = _through_lens(city_map, model, rng)
    light = _light(camera.width_px, camera.height_px)
    lit = _lit(picture, light)
    draw_map_tag(lit, model, city_map.tag)
    far_first = sorted(_standing(city_map), key=lambda one: -_distance(one, model))
    drawn = [(_draw_obstacle(lit, model, solid), solid.top[0, 2]) for solid in far_first]
    return Scenery(lit, light, tuple(one for one, height in drawn if height > LOW_M))


def draw_box(frame: Image, model: CameraModel, box: Box, at: Pose2) -> None:
    """Paint a movable box at its present pose."""
    foot = rectangle(at.x, at.y, box.length_m, box.width_m, at.yaw)
    _draw_obstacle(frame, model, prism(foot, 0.0, box.height_m, CARDBOARD))


def draw_map_tag(frame: Image, model: CameraModel, tag: MapTag) -> None:
    """Paint the tag on the floor that defines the map's frame."""
    pose = Pose2(tag.x_m, tag.y_m, tag.yaw_rad)
    corners = [(*pose.apply(x, y), 0.0) for x, y in tag_corners(tag.size_m * PRINT_SCALE)]
    pixels = model.project(np.array(corners))
    canvas = Canvas(frame, pixels, scale=4)
    if not canvas.is_empty:
        canvas.picture(printed_tag(tag.tag_id), pixels)
        canvas.put_back()


def _through_lens(city_map: CityMap, model: CameraModel, rng: np.random.Generator) -> Image:
    width, height = model.camera.width_px, model.camera.height_px
    columns = np.arange(-GRID_PX, width + 2 * GRID_PX, GRID_PX, dtype=np.float64)
    rows = np.arange(-GRID_PX, height + 2 * GRID_PX, GRID_PX, dtype=np.float64)
    seen = _on_floor(city_map, model, np.stack(np.meshgrid(columns, rows), axis=-1))
    corner = seen.reshape(-1, 2).min(axis=0)
    extent = seen.reshape(-1, 2).max(axis=0) - corner
    sheet = FloorSheet(float(corner[0]), float(corner[1] + extent[1]), extent, rng)
    paint_floor(sheet, city_map)
    over, down = _interpolation(columns, width), _interpolation(rows, height)
    across, along = seen[..., 0] @ over.T, seen[..., 1] @ over.T
    picture = np.empty((height, width, 3), dtype=np.uint8)
    for top in range(0, height, STRIP_PX):
        part = down[top * FINER : (top + STRIP_PX) * FINER]
        x = (part @ across - sheet.left) * sheet.texels_per_m - 0.5
        y = (sheet.upper - part @ along) * sheet.texels_per_m - 0.5
        fine = cv2.remap(
            sheet.picture, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        size = width, len(part) // FINER
        picture[top : top + STRIP_PX] = cv2.resize(fine, size, interpolation=cv2.INTER_AREA)
    return picture


def _on_floor(city_map: CityMap, model: CameraModel, pixels: Floats) -> Floats:
    """Return where pixels see the floor, (..., 2) [m]; distant floor and sky are clipped.

    A tilted camera sees the floor out to its horizon: a sheet of all that would have no end.
    """
    ideal = model.undistort(pixels)
    ahead = np.ones((*ideal.shape[:-1], 1))
    down = -(np.concatenate((ideal, ahead), axis=-1) @ model.camera_R_map)[..., 2:]
    flat = np.where(down > LEAST_FALL, model.on_plane(ideal, 0.0), np.nan)
    away = ideal @ model.camera_R_map[:2, :2] + model.camera_R_map[2, :2]
    seen = np.where(np.isnan(flat), model.position[:2] + 1e3 * away, flat)
    floor = city_map.floor
    low = np.array([floor.x_m[0], floor.y_m[0]]) - AROUND_M
    high = np.array([floor.x_m[1], floor.y_m[1]]) + AROUND_M
    held: Floats = np.clip(seen, low, high)
    return held


def _interpolation(knots: Floats, count: int) -> Floats:
    """Return the weights (count * FINER, knots) that interpolate linearly at each fine pixel."""
    at = ((np.arange(count * FINER) + 0.5) / FINER - 0.5 - knots[0]) / GRID_PX
    left = np.floor(at).astype(int)
    weights = np.zeros((len(at), len(knots)))
    rows = np.arange(len(at))
    weights[rows, left] = 1.0 - (at - left)
    weights[rows, left + 1] = at - left
    return weights


def _lit(picture: Image, light: Floats) -> Image:
    lit = np.empty_like(picture)
    for top in range(0, len(picture), STRIP_PX):
        strip = slice(top, top + STRIP_PX)
        lit[strip] = np.clip(picture[strip] * light[strip, :, None], 0.0, 255.0).astype(np.uint8)
    return lit


def _light(width: int, height: int) -> Floats:
    """Return the light of a lamp off the middle, and a lens that is darker towards its corners."""
    x = (np.arange(width) - 0.42 * width) / width
    y = (np.arange(height) - 0.4 * height) / width
    light: Floats = 1.08 - 0.5 * (x[None, :] ** 2 + y[:, None] ** 2)
    return light


def _standing(city_map: CityMap) -> list[Solid]:
    solids = [
        prism(rectangle(b.x_m, b.y_m, b.length_m, b.width_m, b.yaw_rad), 0.0, b.height_m, CARDBOARD)
        for b in city_map.boxes
        if b.mass_kg is None
    ]
    for wall in city_map.walls:
        solids += [prism(piece, 0.0, wall.height_m, BRICK) for piece in wall_pieces(wall)]
    for light in city_map.lights:
        foot = rectangle(light.x_m, light.y_m, 0.03, 0.03, light.yaw_rad)
        solids.append(prism(foot, 0.0, 0.012, (48, 48, 48)))
    return solids


def _distance(solid: Solid, model: CameraModel) -> float:
    """Return the distance of the foot's nearest edge from the point below the camera [m]."""
    foot = solid.bottom[:, :2] - model.position[:2]
    span = np.roll(foot, -1, axis=0) - foot
    along = np.clip(-(foot * span).sum(axis=1) / (span * span).sum(axis=1), 0.0, 1.0)
    near = foot + along[:, None] * span
    return float(np.hypot(near[:, 0], near[:, 1]).min())


def _draw_obstacle(frame: Image, model: CameraModel, solid: Solid) -> Obstacle:
    shape = shape_of((solid,))
    pixels = model.project(shape.points)
    canvas = Canvas(frame, pixels)
    corner = int(canvas.corner[0]), int(canvas.corner[1])
    foot = solid.bottom[:, :2]
    if canvas.is_empty:
        return Obstacle(foot, corner, np.zeros((0, 0), dtype=np.bool_))
    draw_shape(canvas, shape, pixels)
    canvas.put_back()
    mask = np.zeros(canvas.window.shape[:2], dtype=np.uint8)
    hull = cv2.convexHull((pixels - canvas.corner).astype(np.float32))
    cv2.fillConvexPoly(mask, np.rint(hull * 16.0).astype(np.int32), 255, cv2.LINE_8, 4)
    return Obstacle(foot, corner, mask > 0)
