"""The floor's shapes as polygons, and its height pieces as planes over convex polygons."""

import math
from typing import NamedTuple

from scm.geometry import Pose2
from scm.records.city_map import Point
from scm.records.floor import Floor, Patch, Plate, Ramp

CIRCLE_CORNERS = 32


class Piece(NamedTuple):
    """A plane above a convex polygon: height = at + rise_x * x + rise_y * y, map frame [m].

    Attributes:
        corners: Counter-clockwise.
    """

    name: str
    corners: tuple[Point, ...]
    at: float
    rise_x: float
    rise_y: float


def outline_of(shape: Patch | Plate) -> tuple[Point, ...]:
    """Return the corners of a patch or plate, counter-clockwise; a circle has many."""
    if shape.points:
        return shape.points if signed_area(shape.points) > 0.0 else shape.points[::-1]
    radius = getattr(shape, "radius_m", None)
    middle = Pose2(shape.x_m or 0.0, shape.y_m or 0.0, shape.yaw_rad)
    if radius is not None:
        turns = (2.0 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS))
        return tuple(middle.apply(radius * math.cos(a), radius * math.sin(a)) for a in turns)
    return rectangle(middle, shape.length_m or 0.0, shape.width_m or 0.0)


def ramp_outline(ramp: Ramp) -> tuple[Point, ...]:
    """Return the corners of a ramp, counter-clockwise, the first at its far left."""
    return rectangle(Pose2(ramp.x_m, ramp.y_m, ramp.yaw_rad), ramp.length_m, ramp.width_m)


def rectangle(middle: Pose2, length: float, width: float) -> tuple[Point, ...]:
    """Return four corners about a pose, counter-clockwise."""
    a, b = length / 2.0, width / 2.0
    return tuple(middle.apply(x, y) for x, y in ((a, b), (-a, b), (-a, -b), (a, -b)))


def pieces_of(floor: Floor) -> list[Piece]:
    """Return everything that stands above the floor's zero."""
    pieces = [Piece(plate.name, outline_of(plate), plate.height_m, 0.0, 0.0)
              for plate in floor.plates]  # fmt: skip
    for ramp in floor.ramps:
        slope = slope_of(ramp)
        rise_x, rise_y = slope * math.cos(ramp.yaw_rad), slope * math.sin(ramp.yaw_rad)
        middle = 0.5 * (ramp.from_m + ramp.to_m)
        at = middle - rise_x * ramp.x_m - rise_y * ramp.y_m
        pieces.append(Piece(ramp.name, ramp_outline(ramp), at, rise_x, rise_y))
    return pieces


def slope_of(ramp: Ramp) -> float:
    """Return how much a ramp rises on a metre along its `yaw_rad`."""
    return (ramp.to_m - ramp.from_m) / ramp.length_m


def signed_area(points: tuple[Point, ...]) -> float:
    """Return the area inside a polygon, positive if it runs counter-clockwise."""
    ends = zip(points, (*points[1:], points[0]), strict=True)
    return 0.5 * sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in ends)


def is_convex(points: tuple[Point, ...]) -> bool:
    """Return whether a polygon has no corner that points inwards."""
    count, turns = len(points), []
    for i in range(count):
        (x0, y0), (x1, y1), (x2, y2) = (points[(i + k) % count] for k in range(3))
        turns.append((x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1))
    return all(turn > 0.0 for turn in turns) or all(turn < 0.0 for turn in turns)
