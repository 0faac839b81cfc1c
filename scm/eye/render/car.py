"""Draws a car from above: body, glass, lamps, steered wheels, shadow, and the roof tag."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from scm.arrays import Floats, Image
from scm.eye.camera import CameraModel
from scm.eye.render.floor import Obstacle, Scenery
from scm.scenery.bodies import CarBody, car_body, car_rotation, colour_of_car
from scm.scenery.canvas import Canvas, Colour
from scm.scenery.car_shape import RUBBER, rounded, shell_of
from scm.scenery.sheet import printed_tag
from scm.scenery.solids import (
    LIGHT,
    Shape,
    Solid,
    draw_shape,
    prism,
    rectangle,
    shape_of,
)
from scm.scenery.tags import PRINT_SCALE, TAG_COUNT, tag_corners
from scm.v2x.messages.world_snapshot import SnapshotVehicle

SHADOW_SHARE = 0.42  # of the light missing under a car
SHADOW_BLUR_PX = 11


def tag_on_roof(car: SnapshotVehicle, scale: float = 1.0) -> Floats:
    """Return the corners of the roof tag in the map frame, (4, 3) [m].

    Args:
        car: At its pose.
        scale: 1 for the black square, `PRINT_SCALE` for the whole print.
    """
    body = car_body(car.car)
    flat = np.column_stack((tag_corners(body.tag_size * scale), np.zeros(4)))
    origin = np.array([car.x_m, car.y_m, 0.0])
    corners: Floats = (flat + body.tag_position) @ car_rotation(car).T + origin
    return corners


@dataclass(frozen=True, slots=True, eq=False)
class LaidOut:
    """A projected car; pixels as from `CameraModel.project`.

    Attributes:
        car: At its pose.
        shape: Its solids in the map frame.
        solid: Their points, (n, 2) [px].
        shade: Outline of its shadow, (m, 2) [px].
        tag: Corners of the roof's whole print, (4, 2) [px].
        foot: Middle of the rear axle on the floor, (2,) [px].
        outline: Around its wheels on the floor, (k, 2) [m].
    """

    car: SnapshotVehicle
    shape: Shape
    solid: Floats
    shade: Floats
    tag: Floats
    foot: Floats
    outline: Floats


def lay_out(model: CameraModel, car: SnapshotVehicle) -> LaidOut:
    """Project a car's parts."""
    rotation, origin = car_rotation(car), np.array([car.x_m, car.y_m, 0.0])
    body = car_body(car.car)
    shape = _shape(body, colour_of_car(car), round(car.steering_rad, 2), frozenset(car.lights))
    shape = shape.placed(rotation, origin)
    outline = _shadow(body) @ rotation.T + origin
    shadow = outline + _shadow_offset(body)
    points = np.concatenate((shape.points, shadow, tag_on_roof(car, PRINT_SCALE), origin[None]))
    pixels = model.project(points)
    solid, shade, tag = np.split(pixels[:-1], (len(shape.points), len(points) - 5))
    return LaidOut(car, shape, solid, shade, tag, pixels[-1], outline[:, :2])


def draw_car(frame: Image, model: CameraModel, scenery: Scenery, car: SnapshotVehicle) -> None:
    """Paint one car into a frame, and over it the obstacles in front of it."""
    placed = lay_out(model, car)
    canvas = paint_car(frame, placed, gain_at(scenery, placed.foot))
    if canvas is not None:
        hide_behind(canvas.window, canvas.corner, scenery, placed.outline, model)


def paint_car(frame: Image, placed: LaidOut, gain: float) -> Canvas | None:
    """Paint a car with its shadow; return the window around its solids, None if outside.

    Args:
        frame: (height, width, 3); changed.
        placed: The car.
        gain: Brightness of the light there.
    """
    whole = np.concatenate((placed.solid, placed.shade, placed.tag, placed.foot[None]))
    ground = Canvas(frame, whole, scale=1, margin=SHADOW_BLUR_PX)
    if ground.is_empty:
        return None
    _cast(ground, placed.shade)
    canvas = Canvas(frame, np.concatenate((placed.solid, placed.tag)))
    if canvas.is_empty:
        return None
    draw_shape(canvas, placed.shape, placed.solid, gain)
    if car_body(placed.car.car).has_tag and 0 <= placed.car.tag_id < TAG_COUNT:
        canvas.picture(_roof_print(placed.car.tag_id, gain), placed.tag)
    canvas.put_back()
    return canvas


def gain_at(scenery: Scenery, pixel: Floats) -> float:
    """Return the brightness at a pixel (2,), to two digits; outside: at the edge."""
    height, width = scenery.light.shape
    x = min(width - 1, max(0, round(float(pixel[0]))))
    y = min(height - 1, max(0, round(float(pixel[1]))))
    return round(float(scenery.light[y, x]), 2)


def hide_behind(
    window: Image, corner: Floats, scenery: Scenery, outline: Floats, model: CameraModel
) -> None:
    """Restore over a car the obstacles between it and the camera.

    Args:
        window: Part of a frame; changed.
        corner: Its first column and row in the frame, (2,).
        scenery: With the obstacles.
        outline: Of the car on the floor, (n, 2) [m].
        model: The camera.
    """
    for obstacle in scenery.obstacles:
        _hide_behind(window, corner, obstacle, scenery.picture, outline, model)


@lru_cache(maxsize=256)
def _roof_print(tag_id: int, gain: float) -> Image:
    return printed_tag(tag_id, gain)


def _cast(canvas: Canvas, outline: Floats) -> None:
    """Darken the floor in the blurred shape of the shadow."""
    height, width = canvas.window.shape[:2]
    keep = np.full((height, width), 255, dtype=np.uint8)
    cv2.fillConvexPoly(
        keep, canvas.fixed(outline), round(255 * (1.0 - SHADOW_SHARE)), cv2.LINE_8, 4
    )
    soft = cv2.GaussianBlur(keep, (SHADOW_BLUR_PX, SHADOW_BLUR_PX), 0.0)
    three = cv2.cvtColor(soft, cv2.COLOR_GRAY2BGR)
    canvas.window[:] = cv2.multiply(canvas.window, three, scale=1.0 / 255.0)


def _hide_behind(
    window: Image,
    corner: Floats,
    obstacle: Obstacle,
    picture: Image,
    outline: Floats,
    model: CameraModel,
) -> None:
    height, width = window.shape[:2]
    x0, y0 = (int(value) for value in corner)
    ox, oy = obstacle.corner
    left, top = max(x0, ox), max(y0, oy)
    right = min(x0 + width, ox + obstacle.mask.shape[1])
    bottom = min(y0 + height, oy + obstacle.mask.shape[0])
    if right <= left or bottom <= top or not obstacle.is_before(outline, model.position[:2]):
        return
    mask = obstacle.mask[top - oy : bottom - oy, left - ox : right - ox]
    part = window[top - y0 : bottom - y0, left - x0 : right - x0]
    part[mask] = picture[top:bottom, left:right][mask]


@lru_cache(maxsize=64)
def _shadow(body: CarBody) -> Floats:
    outline = rounded(*body.x_span, *body.y_span, 0.03)
    return np.column_stack((outline, np.zeros(len(outline))))


def _shadow_offset(body: CarBody) -> Floats:
    reach = 0.28 * body.tag_position[2]
    return np.array([-LIGHT[0] * reach, -LIGHT[1] * reach, 0.0])


@lru_cache(maxsize=1024)
def _shape(body: CarBody, colour: Colour, steering: float, lamps: frozenset[str]) -> Shape:
    return shape_of((*_wheels(body, steering), *shell_of(body, colour, lamps)))


def _wheels(body: CarBody, steering: float) -> tuple[Solid, ...]:
    wheels = []
    for x, turn in ((0.0, 0.0), (body.wheelbase, steering)):
        for side in (1.0, -1.0):
            tread = rectangle(
                x, side * body.track / 2, 2 * body.wheel_radius, body.wheel_width, turn
            )
            wheels.append(prism(tread, 0.0, 1.7 * body.wheel_radius, RUBBER, taper=0.12))
    return tuple(wheels)
