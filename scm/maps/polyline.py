"""A curve on the floor as dense points: place from distance, and distance from place.

Plain Python on lists instead of arrays: one car asks for one point at a time, fifty times a second.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2, wrap_angle
from scm.records.city_map import Segment

STEP_M = 0.01


class Polyline:
    """A smooth curve sampled every centimetre.

    Attributes:
        points: Shape (n, 2) [m]; of a closed curve the last point is the first one again.
        s: Shape (n,): distance along the curve [m], from 0.
        yaw: Shape (n,): direction of the curve [rad], continuous (not wrapped).
        curvature: Shape (n,): + = turns left [1/m], of the stretch that begins at the point.
        length_m: Of the whole curve.
        closed: Distances go on for ever, lap after lap.
    """

    def __init__(
        self, points: Floats, s: Floats, yaw: Floats, curvature: Floats, *, closed: bool = False
    ) -> None:
        self.points, self.s, self.yaw, self.curvature = points, s, yaw, curvature
        self.length_m = float(s[-1])
        self.closed = closed
        self._x: list[float] = points[:, 0].tolist()
        self._y: list[float] = points[:, 1].tolist()
        self._s: list[float] = s.tolist()
        self._yaw: list[float] = yaw.tolist()
        self._curvature: list[float] = curvature.tolist()
        self._last = len(self._s) - 2

    def at(self, s: float) -> Pose2:
        """Return the pose on the curve; beyond an open end it stays at the end."""
        s = self._inside(s)
        i = self._index(s)
        t = (s - self._s[i]) / (self._s[i + 1] - self._s[i])
        return Pose2(
            self._x[i] + t * (self._x[i + 1] - self._x[i]),
            self._y[i] + t * (self._y[i + 1] - self._y[i]),
            wrap_angle(self._yaw[i] + t * (self._yaw[i + 1] - self._yaw[i])),
        )

    def yaw_at(self, s: float) -> float:
        """Return the direction of the curve [rad], that of `at`."""
        s = self._inside(s)
        i = self._index(s)
        t = (s - self._s[i]) / (self._s[i + 1] - self._s[i])
        return wrap_angle(self._yaw[i] + t * (self._yaw[i + 1] - self._yaw[i]))

    def curvature_at(self, s: float) -> float:
        """Return the curvature [1/m], + = turns left."""
        return self._curvature[self._index(self._inside(s))]

    def project(self, x: float, y: float, near_s: float | None = None) -> tuple[float, float]:
        """Return distance along the curve and distance beside it [m], + = left of it.

        Args:
            x: Of the point, map frame [m].
            y: Of the point, map frame [m].
            near_s: Where the point was before: the search walks from there downhill, and on a
                closed curve the answer counts on through the laps. None: the whole curve is
                searched.
        """
        if near_s is None:
            squared = (self.points[:, 0] - x) ** 2 + (self.points[:, 1] - y) ** 2
            start, laps_m = min(int(np.argmin(squared)), self._last), 0.0
        else:
            inside = self._inside(near_s)
            start = self._index(inside)
            laps_m = near_s - inside if self.closed else 0.0
        s, lateral = self._descend(x, y, start)
        return s + laps_m, lateral

    def _descend(self, x: float, y: float, i: int) -> tuple[float, float]:
        """Walk over the stretches, from number `i` on, to the one whose normal meets the point."""
        xs, ys = self._x, self._y
        laps_m, before = 0.0, 0
        for _ in range(self._last + 2):
            x0, y0 = xs[i], ys[i]
            dx, dy, px, py = xs[i + 1] - x0, ys[i + 1] - y0, x - x0, y - y0
            step_m = math.hypot(dx, dy)
            along = (px * dx + py * dy) / step_m
            way = -1 if along < 0.0 else 1 if along > step_m else 0
            if way in (0, -before):  # in a bend a point may lie between two normals
                break
            before = way
            following = i + way
            if not 0 <= following <= self._last:
                if not self.closed:
                    break
                laps_m += way * self.length_m
                following %= self._last + 1
            i = following
        lateral = (dx * py - dy * px) / step_m
        return self._s[i] + min(max(along, 0.0), step_m) + laps_m, lateral

    def _inside(self, s: float) -> float:
        """Return the same place as a distance from 0 to the length."""
        if self.closed:
            return s % self.length_m
        return min(max(s, 0.0), self.length_m)

    def _index(self, s: float) -> int:
        """Return the number of the stretch that holds this distance."""
        return min(max(bisect_right(self._s, s) - 1, 0), self._last)


def sample(start: Pose2, segments: Sequence[Segment]) -> Polyline:
    """Return the curve that begins at a pose and follows straights and arcs exactly."""
    xs, ys, ss, yaws, curvatures = [start.x], [start.y], [0.0], [start.yaw], [0.0]
    pose, yaw, travelled = start, start.yaw, 0.0
    for segment in segments:
        length, curvature = extent(segment)
        count = max(1, math.ceil(length / STEP_M - 1e-9))
        curvatures[-1] = curvature
        for k in range(1, count + 1):
            done = length * k / count
            placed = advance(pose, done, curvature)
            xs.append(placed.x)
            ys.append(placed.y)
            ss.append(travelled + done)
            yaws.append(yaw + curvature * done)
            curvatures.append(curvature)
        pose, yaw, travelled = advance(pose, length, curvature), yaws[-1], travelled + length
    return Polyline(np.array([xs, ys]).T.copy(), np.array(ss), np.array(yaws), np.array(curvatures))


def extent(segment: Segment) -> tuple[float, float]:
    """Return a segment's length [m] and curvature [1/m], + = left."""
    if segment.radius_m is not None and segment.angle_rad is not None:
        length = segment.radius_m * abs(segment.angle_rad)
        return length, math.copysign(1.0 / segment.radius_m, segment.angle_rad)
    return segment.length_m or 0.0, 0.0


def advance(pose: Pose2, length: float, curvature: float) -> Pose2:
    """Return the pose after a way of constant curvature."""
    turned = curvature * length
    if curvature == 0.0:
        return pose @ Pose2(length, 0.0, 0.0)
    return pose @ Pose2(math.sin(turned) / curvature, (1.0 - math.cos(turned)) / curvature, turned)


def join(pieces: Sequence[Polyline], *, closed: bool = False) -> Polyline:
    """Return one curve through pieces that each begin where the one before ends."""
    points, ss, yaws, curvatures = [], [], [], []
    travelled, yaw = 0.0, float(pieces[0].yaw[0])
    for number, piece in enumerate(pieces, start=1):
        upto = len(piece.s) if number == len(pieces) else len(piece.s) - 1
        # A piece's own yaw may differ by whole turns from where the piece before ended.
        shift = round((yaw - float(piece.yaw[0])) / math.tau) * math.tau
        points.append(piece.points[:upto])
        ss.append(piece.s[:upto] + travelled)
        yaws.append(piece.yaw[:upto] + shift)
        curvatures.append(piece.curvature[:upto])
        travelled += piece.length_m
        yaw = float(piece.yaw[-1]) + shift
    return Polyline(
        np.concatenate(points),
        np.concatenate(ss),
        np.concatenate(yaws),
        np.concatenate(curvatures),
        closed=closed,
    )
