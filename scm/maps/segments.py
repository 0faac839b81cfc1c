"""The edges of walls and boxes as straight segments: what a LIDAR ray hits and a car bumps into."""

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.records.city_map import Box, CityMap, Point, Wall

MITRE_LIMIT = 4.0


def wall_segments(city_map: CityMap) -> Floats:
    """Return all edges of walls and boxes that stay, shape (m, 4): x0, y0, x1, y1 [m].

    A wall of thickness 0 is its own edge; a thicker one has one edge on each side and, if it is
    open, one at each end.
    """
    edges: list[tuple[float, float, float, float]] = []
    for wall in city_map.walls:
        for outline in wall_outlines(wall):
            edges += _edges(outline)
    for box in city_map.boxes:
        if box.mass_kg is not None:
            continue
        edges += _edges(box_outline(box))
    return np.array(edges, dtype=np.float64).reshape(-1, 4)


def wall_outlines(wall: Wall) -> list[tuple[Point, ...]]:
    """Return a wall's faces as polylines; one that is a ring repeats its first point at the end.

    An open wall has one ring round it, a closed one has two rings, a wall of no thickness has
    its own line.
    """
    points = _without_repeats(wall.points, closed=wall.closed)
    if wall.thickness_m == 0.0:
        return [(*points, points[0])] if wall.closed else [points]
    half = wall.thickness_m / 2.0
    left = _beside(points, half, closed=wall.closed)
    right = _beside(points, -half, closed=wall.closed)
    if wall.closed:
        return [(*left, left[0]), (*right, right[0])]
    return [(*left, *reversed(right), left[0])]


def box_outline(box: Box) -> tuple[Point, ...]:
    """Return a box's footprint; the first corner is repeated at the end."""
    pose = Pose2(box.x_m, box.y_m, box.yaw_rad)
    a, b = box.length_m / 2.0, box.width_m / 2.0
    corners = tuple(pose.apply(x, y) for x, y in ((a, b), (-a, b), (-a, -b), (a, -b)))
    return (*corners, corners[0])


def _edges(outline: Sequence[Point]) -> Iterator[tuple[float, float, float, float]]:
    for (x0, y0), (x1, y1) in itertools.pairwise(outline):
        yield x0, y0, x1, y1


def _without_repeats(points: Sequence[Point], *, closed: bool) -> tuple[Point, ...]:
    """Return the points without any that equals the one before it."""
    distinct = [points[0]]
    for point in points[1:]:
        if point != distinct[-1]:
            distinct.append(point)
    if closed and len(distinct) > 1 and distinct[-1] == distinct[0]:
        distinct.pop()
    return tuple(distinct)


def _beside(points: Sequence[Point], distance: float, *, closed: bool) -> list[Point]:
    """Return the line at a distance to the left, its corners mitred."""
    count = len(points)
    beside = []
    for i, (x, y) in enumerate(points):
        before = _normal(points[i - 1], points[i]) if closed or i > 0 else None
        after = _normal(points[i], points[(i + 1) % count]) if closed or i < count - 1 else None
        first, second = before or after or (0.0, 0.0), after or before or (0.0, 0.0)
        nx, ny = first[0] + second[0], first[1] + second[1]
        squared = nx * nx + ny * ny
        # 2/|n1+n2|^2 stretches the sum of normals to the mitre; a hairpin is cut off instead.
        stretch = min(2.0 / squared, MITRE_LIMIT) if squared > 0.0 else 0.0
        beside.append((x + distance * stretch * nx, y + distance * stretch * ny))
    return beside


def _normal(start: Point, end: Point) -> Point:
    """Return the unit vector to the left of the way from start to end."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    return -dy / length, dx / length
