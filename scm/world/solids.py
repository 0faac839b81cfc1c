"""Cars, boxes and walls as pymunk bodies and shapes, and walls as boxes for the first sieve."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pymunk

from scm.arrays import Floats
from scm.records.city_map import Box, CityMap, Wall
from scm.vehicles.car import Car
from scm.vehicles.shape import shape_of
from scm.world.boxes import GRAVITY, arm_of, inertia_of, mass_of

MEETS_CARS, MEETS_WALLS, WALL, BOX = 0b0001, 0b0010, 0b0100, 0b1000
BOX_GRIP = 0.5  # between two boxes, and of a box on a wall


class Hull(NamedTuple):
    """What a car is to others: a box about its centre of gravity, body frame, SI."""

    mass: float
    yaw_inertia: float
    rear: float
    front: float
    right: float
    left: float
    restitution: float
    friction: float
    movable: bool = True


def outline_of(hull: Hull) -> tuple[float, float, float, float, float, float]:
    """Return middle ahead and left of the centre of gravity, half length, half width, reach.

    The last is 1, or 0 for one that nobody moves.
    """
    ahead, left = 0.5 * (hull.front + hull.rear), 0.5 * (hull.left + hull.right)
    reach = math.hypot(max(hull.front, -hull.rear), max(hull.left, -hull.right))
    length, width = hull.front - hull.rear, hull.left - hull.right
    return ahead, left, 0.5 * length, 0.5 * width, reach, float(hull.movable)


def car_body(hull: Hull) -> pymunk.Body:
    """Return a car with its two shapes."""
    body = pymunk.Body(hull.mass, hull.yaw_inertia)
    corners = [
        (hull.rear, hull.right),
        (hull.front, hull.right),
        (hull.front, hull.left),
        (hull.rear, hull.left),
    ]
    root = math.sqrt(hull.restitution), math.sqrt(hull.friction)
    _shape(pymunk.Poly(body, corners), MEETS_CARS, MEETS_CARS, *root)
    _shape(pymunk.Poly(body, corners), MEETS_WALLS, WALL, hull.restitution, hull.friction)
    return body


def box_body(
    box: Box, static: pymunk.Body, scale: float
) -> tuple[pymunk.Body, tuple[pymunk.Constraint, ...]]:
    """Return a box that slides, with its shapes, and its brakes on the floor.

    Whoever takes the brakes must hold them: a body knows its constraints weakly, so a collector
    of cycles that ran while they are in no space would leave a box that slides for ever.

    Args:
        box: A movable one.
        static: The floor.
        scale: Duration between two steps over that of a step: a brake's limit is a force.
    """
    body = pymunk.Body(mass_of(box), inertia_of(box))
    a, b = 0.5 * box.length_m, 0.5 * box.width_m
    corners = [(a, b), (-a, b), (-a, -b), (a, -b)]
    _shape(pymunk.Poly(body, corners), WALL, MEETS_WALLS, 1.0, 1.0)
    _shape(pymunk.Poly(body, corners), BOX, BOX | WALL, 0.0, BOX_GRIP)
    slides = pymunk.PivotJoint(static, body, (0.0, 0.0), (0.0, 0.0))
    turns = pymunk.GearJoint(static, body, 0.0, 1.0)
    slides.max_force = scale * box.friction * mass_of(box) * GRAVITY
    turns.max_force = slides.max_force * arm_of(box)
    brakes = slides, turns
    for brake in brakes:
        brake.max_bias = 0.0  # a brake forgets where the box once was
    return body, brakes


def _shape(
    shape: pymunk.Shape, category: int, mask: int, restitution: float, friction: float
) -> pymunk.Shape:
    shape.elasticity, shape.friction = restitution, friction
    shape.filter = pymunk.ShapeFilter(categories=category, mask=mask)
    return shape


class Solid(NamedTuple):
    """Something that never moves, map frame [m]: a straight wall, or a box.

    Attributes:
        points: Both ends of the wall, or the corners of the box.
        radius: Half the wall's thickness.
    """

    points: tuple[tuple[float, float], ...]
    radius: float = 0.0


def solids(city_map: CityMap) -> list[Solid]:
    """Return all that never moves, in the order of `obstacle_boxes`."""
    found = [Solid(run, 0.5 * wall.thickness_m) for wall in city_map.walls for run in _runs(wall)]
    for box in city_map.boxes:
        if box.mass_kg is None:
            c, s = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
            half = ((1, 1), (-1, 1), (-1, -1), (1, -1))
            sizes = [(0.5 * i * box.length_m, 0.5 * j * box.width_m) for i, j in half]
            found.append(
                Solid(tuple((box.x_m + c * x - s * y, box.y_m + s * x + c * y) for x, y in sizes))
            )
    return found


def solid_shape(static: pymunk.Body, solid: Solid) -> pymunk.Shape:
    """Return the shape of what never moves, on a space's static body."""
    if len(solid.points) == 2:
        return _solid(pymunk.Segment(static, *solid.points, solid.radius))
    return _solid(pymunk.Poly(static, solid.points))


def obstacle_boxes(city_map: CityMap, *, round_ends: bool = True) -> Floats:
    """Return all that never moves as boxes (m, 6): x, y, cos, sin of yaw, half length and width.

    Args:
        city_map: The city.
        round_ends: Whether the boxes of walls hold the round ends of their pieces.
    """
    found = []
    for wall in city_map.walls:
        half = 0.5 * wall.thickness_m
        for (x0, y0), (x1, y1) in _runs(wall):
            length = math.hypot(x1 - x0, y1 - y0)
            c, s = ((x1 - x0) / length, (y1 - y0) / length) if length else (1.0, 0.0)
            end = half if round_ends else 0.0
            found.append((0.5 * (x0 + x1), 0.5 * (y0 + y1), c, s, 0.5 * length + end, half))
    found += [
        (b.x_m, b.y_m, math.cos(b.yaw_rad), math.sin(b.yaw_rad), 0.5 * b.length_m, 0.5 * b.width_m)
        for b in city_map.boxes
        if b.mass_kg is None
    ]
    return np.array(found, dtype=float).reshape(-1, 6)


def _runs(wall: Wall) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    points = [*wall.points, wall.points[0]] if wall.closed else list(wall.points)
    return pairwise(points)


def _solid(shape: pymunk.Shape) -> pymunk.Shape:
    return _shape(shape, WALL, MEETS_WALLS | BOX, 1.0, 1.0)


def hull_of(car: Car, *, movable: bool = True) -> Hull:
    """Return the contact body of a car file; an immovable one pushes and is not pushed."""
    shape = shape_of(car)
    cog = shape.cog_to_rear_axle
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    heavy = 1.0 if movable else 1e6
    return Hull(
        mass=shape.mass * heavy,
        yaw_inertia=car.value("body.yaw_inertia_kgm2") * heavy,
        rear=rear - cog,
        front=front - cog,
        right=right,
        left=left,
        restitution=car.value("body.bounce_restitution"),
        friction=car.value("body.contact_friction"),
        movable=movable,
    )


def outline(car: Car, poses: Floats) -> Floats:
    """Return the four faces of each car, (4 n, 4) x0, y0, x1, y1, of rear-axle poses (n, 3)."""
    rear, front = car.vector("body.footprint_x_m")
    right, left = car.vector("body.footprint_y_m")
    along = np.array([rear, front, front, rear])
    across = np.array([right, right, left, left])
    x, y, yaw = (column[:, None] for column in poses.T)
    c, s = np.cos(yaw), np.sin(yaw)
    corners = np.stack((x + c * along - s * across, y + s * along + c * across), axis=2)
    faces = np.concatenate((corners, np.roll(corners, -1, axis=1)), axis=2)
    return faces.reshape(-1, 4)


def cog_motion(ahead: float, motion: Floats) -> Floats:
    """Return the motion of the centres of gravity, (n, 6) x, y, yaw, vx, vy, yaw rate, map frame.

    Args:
        ahead: How far ahead of the rear axle they are [m].
        motion: (n, 6) of the rear axles: x, y, yaw, speed along and across the body, yaw rate.
    """
    x, y, yaw, speed, lateral, rate = motion.T
    c, s = np.cos(yaw), np.sin(yaw)
    across = lateral + ahead * rate
    return np.column_stack(
        (x + ahead * c, y + ahead * s, yaw, c * speed - s * across, s * speed + c * across, rate)
    )
