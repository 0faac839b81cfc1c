"""Straights and arcs for polylines and for the turns between them, always tangent-continuous.

corner   a vertex that turns by t is rounded by an arc of radius R; the arc leaves the vertex
         by R (1 / cos(t/2) - 1) and takes R tan(t/2) of each leg
turn     from pose to pose: straight, arc, straight where the two directions meet ahead, else
         two arcs that meet midway between equal tangents; the wider of both
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2, wrap_angle
from scm.maps.polyline import advance, extent
from scm.records.city_map import Point, Segment

ROUNDING_M = 1e-6
ROUNDING_RAD = 1e-7
DOT_M = 0.04
FINE_M = 0.01


class Curve(NamedTuple):
    """A pose and what follows it, straights and arcs."""

    start: Pose2
    segments: tuple[Segment, ...]

    @property
    def end(self) -> Pose2:
        """Where it ends."""
        pose = self.start
        for segment in self.segments:
            pose = advance(pose, *extent(segment))
        return pose

    @property
    def length_m(self) -> float:
        """Along it."""
        return sum(extent(segment)[0] for segment in self.segments)

    @property
    def least_radius_m(self) -> float:
        """Of its tightest arc; infinite when it is straight."""
        return min((s.radius_m for s in self.segments if s.radius_m is not None), default=math.inf)


def length_of(points: Sequence[Point]) -> float:
    """Return the length of a polyline."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


def cut(points: Sequence[Point], from_m: float, to_m: float) -> list[Point]:
    """Return the piece of a polyline between two distances from its start."""
    points_left, at = [_point_at(points, from_m)], 0.0
    for before, point in itertools.pairwise(points):
        at += math.dist(before, point)
        if from_m + ROUNDING_M < at < to_m - ROUNDING_M:
            points_left.append(point)
    points_left.append(_point_at(points, to_m))
    return points_left


def _point_at(points: Sequence[Point], at_m: float) -> Point:
    for a, b in itertools.pairwise(points):
        leg = math.dist(a, b)
        if at_m <= leg and leg > 0.0:
            t = max(0.0, at_m) / leg
            return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])
        at_m -= leg
    return points[-1]


def fit(points: Sequence[Point], least_radius_m: float, error_m: float) -> Curve:
    """Return a curve along a polyline, as close as its corners can be taken.

    Corners are left out, smallest first, until every one that is left has room for an arc of the
    least radius; `distance_m` tells how far the curve then lies from the polyline.
    """
    tolerance_m = error_m / 2.0
    while True:
        points_left = simplified(points, tolerance_m)
        radii = _radii(points_left, least_radius_m, error_m)
        if len(points_left) == 2 or min(radii) >= least_radius_m:
            return _rounded(points_left, radii)
        tolerance_m *= 1.5


def simplified(points: Sequence[Point], tolerance_m: float) -> list[Point]:
    """Return a polyline without the points that lie within a distance of what is left."""
    if len(points) < 3:
        return list(points)
    start, end = points[0], points[-1]
    away = [_beside(point, start, end) for point in points[1:-1]]
    worst = max(range(len(away)), key=away.__getitem__)
    if away[worst] <= tolerance_m:
        return [start, end]
    split = worst + 1
    left = simplified(points[: split + 1], tolerance_m)
    return left[:-1] + simplified(points[split:], tolerance_m)


def _beside(point: Point, start: Point, end: Point) -> float:
    """Return a point's distance from a leg [m]."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    squared = dx * dx + dy * dy
    along = (point[0] - start[0]) * dx + (point[1] - start[1]) * dy
    t = min(max(along / squared, 0.0), 1.0) if squared else 0.0
    return math.dist(point, (start[0] + t * dx, start[1] + t * dy))


def _radii(points: Sequence[Point], least_m: float, error_m: float) -> list[float]:
    """Return the radius at each inner vertex: what the error allows and the legs have room for."""
    legs = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    radii = []
    for k, turn in enumerate(_turns(points), start=1):
        half = math.tan(abs(turn) / 2.0)
        if half < ROUNDING_RAD:
            radii.append(math.inf)
            continue
        before = legs[k - 1] * (1.0 if k == 1 else 0.5)
        after = legs[k] * (1.0 if k == len(legs) - 1 else 0.5)
        allowed = error_m / max(1.0 / math.cos(turn / 2.0) - 1.0, 1e-12)
        radii.append(min(min(before, after) / half, max(least_m, allowed)))
    return radii


def _turns(points: Sequence[Point]) -> list[float]:
    yaws = _yaws(points)
    return [wrap_angle(b - a) for a, b in itertools.pairwise(yaws)]


def _yaws(points: Sequence[Point]) -> list[float]:
    pairs = itertools.pairwise(points)
    return [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairs]


def _rounded(points: Sequence[Point], radii: Sequence[float]) -> Curve:
    legs = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    turns = _turns(points)
    tangents_m = [
        radius * math.tan(abs(turn) / 2.0) if math.isfinite(radius) else 0.0
        for radius, turn in zip(radii, turns, strict=True)
    ]
    segments: list[Segment] = []
    for k, leg in enumerate(legs):
        used = (tangents_m[k - 1] if k else 0.0) + (tangents_m[k] if k < len(tangents_m) else 0.0)
        if leg - used > ROUNDING_M:
            segments.append(Segment(length_m=leg - used))
        if k < len(turns) and math.isfinite(radii[k]):
            segments.append(Segment(radius_m=radii[k], angle_rad=turns[k]))
    return Curve(Pose2(*points[0], _yaws(points)[0]), tuple(segments))


def turn(start: Pose2, end: Pose2) -> Curve | None:
    """Return the wider of the two ways to turn from pose to pose; None: there is none ahead."""
    ways = [way for way in (_by_corner(start, end), _by_two_arcs(start, end)) if way is not None]
    return max(ways, key=lambda way: way.least_radius_m, default=None)


def _by_corner(start: Pose2, end: Pose2) -> Curve | None:
    angle = wrap_angle(end.yaw - start.yaw)
    sine = math.sin(angle)
    dx, dy = end.x - start.x, end.y - start.y
    if abs(sine) < 1e-3:
        beside = -math.sin(start.yaw) * dx + math.cos(start.yaw) * dy
        along = math.cos(start.yaw) * dx + math.sin(start.yaw) * dy
        is_straight = abs(angle) < ROUNDING_RAD and abs(beside) < ROUNDING_M and along > 0.0
        return Curve(start, (Segment(length_m=along),)) if is_straight else None
    before = (dx * math.sin(end.yaw) - dy * math.cos(end.yaw)) / sine
    after = (math.cos(start.yaw) * dy - math.sin(start.yaw) * dx) / sine
    used = min(before, after)
    if used <= ROUNDING_M:
        return None
    pieces = [Segment(length_m=before - used)] if before - used > ROUNDING_M else []
    pieces.append(Segment(radius_m=used / math.tan(abs(angle) / 2.0), angle_rad=angle))
    pieces += [Segment(length_m=after - used)] if after - used > ROUNDING_M else []
    return Curve(start, tuple(pieces))


def _by_two_arcs(start: Pose2, end: Pose2) -> Curve | None:
    dx, dy = end.x - start.x, end.y - start.y
    tx, ty = math.cos(start.yaw) + math.cos(end.yaw), math.sin(start.yaw) + math.sin(end.yaw)
    squared, along = dx * dx + dy * dy, dx * tx + dy * ty
    bend = 2.0 * (math.cos(end.yaw - start.yaw) - 1.0)
    if bend > -1e-9:
        if along <= ROUNDING_M:
            return None
        reach = squared / (2.0 * along)
    else:
        reach = (along - math.sqrt(along * along - bend * squared)) / bend
    ahead = start @ Pose2(reach, 0.0, 0.0)
    behind = end @ Pose2(-reach, 0.0, 0.0)
    middle = ((ahead.x + behind.x) / 2.0, (ahead.y + behind.y) / 2.0)
    first, yaw = _arc(start, middle)
    second, _ = _arc(Pose2(*middle, yaw), (end.x, end.y))
    return Curve(start, (*first, *second))


def _arc(start: Pose2, end: Point) -> tuple[tuple[Segment, ...], float]:
    """Return the arc from a pose to a point, and the heading there."""
    chord = math.dist((start.x, start.y), end)
    if chord < ROUNDING_M:
        return (), start.yaw
    half = wrap_angle(math.atan2(end[1] - start.y, end[0] - start.x) - start.yaw)
    if abs(half) < ROUNDING_RAD:
        return (Segment(length_m=chord),), start.yaw
    radius = chord / (2.0 * math.sin(abs(half)))
    return (Segment(radius_m=radius, angle_rad=2.0 * half),), start.yaw + 2.0 * half


class Dots(NamedTuple):
    """Places along a curve, its ends included: (n, 2) points, (n,) headings, (n,) distances."""

    points: Floats
    yaw: Floats
    at_m: Floats


def dotted(curve: Curve, apart_m: float = DOT_M) -> Dots:
    """Return places along a curve, so far apart or less."""
    pose, begin_m = curve.start, 0.0
    points, yaws, places = [], [], []
    for segment in curve.segments:
        length, bend = extent(segment)
        s = np.linspace(0.0, length, max(1, math.ceil(length / apart_m)), endpoint=False)
        arc = np.stack((np.sin(bend * s), 1.0 - np.cos(bend * s)))
        ahead = arc / bend if bend else np.stack((s, 0.0 * s))
        points.append(turned(ahead.T, pose.yaw) + np.array((pose.x, pose.y)))
        yaws.append(pose.yaw + bend * s)
        places.append(begin_m + s)
        pose, begin_m = advance(pose, length, bend), begin_m + length
    return Dots(
        np.concatenate((*points, [[pose.x, pose.y]])),
        np.concatenate((*yaws, [pose.yaw])),
        np.concatenate((*places, [begin_m])),
    )


def turned(points: Floats, yaw: float | Floats) -> Floats:
    """Return points (n, 2) turned about the origin by one angle, or each by its own (n,)."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = points.T
    return np.stack((cos * x - sin * y, sin * x + cos * y), axis=1)


def distance_m(points: Sequence[Point], curve: Curve) -> float:
    """Return how far the farthest place of a polyline lies from a curve."""
    line = dotted(curve, FINE_M).points
    dense = _dense(points)
    squared = ((dense[:, None, :] - line[None, :, :]) ** 2).sum(axis=2).min(axis=1)
    return float(math.sqrt(squared.max()))


def _dense(points: Sequence[Point]) -> Floats:
    """Return a polyline's points and more between them, (n, 2)."""
    rows = [np.array(points[:1], np.float64)]
    for a, b in itertools.pairwise(points):
        count = max(1, math.ceil(math.dist(a, b) / 0.05))
        rows.append(np.linspace(a, b, count + 1)[1:])
    return np.vstack(rows)
