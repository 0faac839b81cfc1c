"""Where a sweep was seen from: its points are laid onto a map, first coarsely, then precisely.

A search over a window of poses scores each by how near the points come to faces of the map, so a
guess may be decimetres wrong. Gauss-Newton then minimises the distances d to the nearest face,

    sum_i w(d_i) d_i^2        w = (c^2 / (c^2 + d^2))^2       c: `WIDE_M` to 3 times the spread

whose weights (Geman-McClure) leave out what the map does not have: people, and places not yet seen.
The guess holds the directions that the sweep does not see, as along a corridor.
Covariance: of the sweep alone, the inverse Hessian times the weighted variance of the distances.
Points beside each other and errors of the map are not independent, so it is a lower bound.
Holds: a level scanner, a pose within the window.
Sources: correlative search, Olson, ICRA 2009; refinement on a map's own slope, Kohlbrecher et al.,
SSRR 2011; distances as in Fitzgibbon, "Robust registration of 2D and 3D point sets", 2003.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2, wrap_angle
from scm.vehicles.jit import array_kernel, inlined

SEARCH_STEP_M = 0.05  # of poses, and of the farthest points as the pose turns
SEARCH_REACH_M = 0.15  # a point farther from every face adds nothing to a pose's score
SEARCH_POINTS = 120
FARTHEST_PART = 75.0  # per cent of points lie nearer than the one that sets the step of yaw
FROM_GUESS = 0.1  # of its score is lost by a pose at the window's edge
WIDE_M, NARROW_M = 0.1, 0.015  # of the weights: at first; at least
ROUNDS = 20
CONVERGED = 1e-5  # [m, rad]
NEAR_CELLS = 2.0  # of a face: there distances have a sign
EXPLAINED_M = 0.075  # three times the noise of a poor scanner
MIN_POINTS = 10
UNSEEN = 1e6  # variance of what no point measures


class Window(NamedTuple):
    """How far a pose may be from the guess: along x and y [m], and in yaw [rad]."""

    xy_m: float = 0.15
    yaw_rad: float = 0.15


NEAR = Window()


class FaceField(Protocol):
    """Distances to the nearest face; `GridMap` is one. Frame and corner are as there."""

    @property
    def to_face_m(self) -> Floats:
        """Shape (rows, columns)."""

    @property
    def cell_m(self) -> float:
        """Edge of a cell."""

    @property
    def x_m(self) -> float:
        """Left edge of the cells."""

    @property
    def y_m(self) -> float:
        """Lower edge of the cells."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Where a sweep was seen from.

    Attributes:
        pose: Of the car in the map's frame [m, m, rad].
        covariance: Of x, y and yaw, (3, 3), from the points alone; 1e6 where they show nothing.
        score: Share of the points that lie within `EXPLAINED_M` of a face.
        residual_m: Root mean square of their distances.
    """

    pose: Pose2
    covariance: Floats
    score: float
    residual_m: float


def match(points: Floats, field: FaceField, guess: Pose2, window: Window | None = NEAR) -> Match:
    """Return where points were seen from.

    Args:
        points: (m, 2) of one sweep, deskewed, car frame [m].
        field: Of the map.
        guess: Pose to begin from, map frame.
        window: To search; None: the guess is within a few centimetres.
    """
    place = float(field.cell_m), float(field.x_m), float(field.y_m)
    begin, std = np.array(guess), np.array((WIDE_M, WIDE_M, WIDE_M))
    if window is not None and len(points) >= MIN_POINTS:
        some = np.ascontiguousarray(points[:: max(1, len(points) // SEARCH_POINTS)])
        far = max(float(np.percentile(np.hypot(*some.T), FARTHEST_PART)), SEARCH_STEP_M)
        step = min(SEARCH_STEP_M / far, max(window.yaw_rad, 1e-3))
        begin = _searched(some, field.to_face_m, *place, begin, *window, step)
        std = np.array((window.xy_m, window.xy_m, window.yaw_rad))
    return _match(points, field, begin, np.array(guess), std)


def _match(points: Floats, field: FaceField, begin: Floats, guess: Floats, std: Floats) -> Match:
    """Return the match that a pose converges to; `std`: of the guess."""
    place = float(field.cell_m), float(field.x_m), float(field.y_m)
    pose, hessian, variance, near, squares = _refined(
        points, field.to_face_m, *place, begin, guess, std
    )
    values, axes = np.linalg.eigh(hessian / variance)
    return Match(
        pose=Pose2(float(pose[0]), float(pose[1]), wrap_angle(float(pose[2]))),
        covariance=(axes / np.maximum(values, 1.0 / UNSEEN)) @ axes.T,
        score=near / max(len(points), 1),
        residual_m=math.sqrt(squares / near) if near else math.inf,
    )


@array_kernel
def _searched(
    points: Floats, to_face: Floats, cell_m: float, x_m: float, y_m: float, guess: Floats,
    window_m: float, window_rad: float, step_rad: float,
) -> Floats:  # fmt: skip
    """Return the pose of the best score, in steps over a window round a guess."""
    rows, columns = to_face.shape
    way, turns = math.ceil(window_m / SEARCH_STEP_M), math.ceil(window_rad / step_rad)
    best, found = -1.0, guess.copy()
    x, y = np.empty(len(points)), np.empty(len(points))
    for turn in range(-turns, turns + 1):
        yaw = guess[2] + turn * step_rad
        c, s = math.cos(yaw), math.sin(yaw)
        for k in range(len(points)):
            x[k] = (guess[0] + c * points[k, 0] - s * points[k, 1] - x_m) / cell_m
            y[k] = (guess[1] + s * points[k, 0] + c * points[k, 1] - y_m) / cell_m
        for up in range(-way, way + 1):
            for right in range(-way, way + 1):
                dx, dy = right * SEARCH_STEP_M / cell_m, up * SEARCH_STEP_M / cell_m
                score = 0.0
                for k in range(len(points)):
                    i, j = math.floor(y[k] + dy), math.floor(x[k] + dx)
                    if 0 <= i < rows and 0 <= j < columns:
                        score += max(0.0, 1.0 - to_face[i, j] / SEARCH_REACH_M)
                off = (up * up + right * right) / max(way * way, 1) + (turn / max(turns, 1)) ** 2
                score *= 1.0 - FROM_GUESS * off
                if score > best:
                    best = score
                    found[0] = guess[0] + right * SEARCH_STEP_M
                    found[1] = guess[1] + up * SEARCH_STEP_M
                    found[2] = yaw
    return found


@inlined
def _from_face(
    field: Floats, cell_m: float, column: float, row: float
) -> tuple[float, float, float]:
    """Return how far a place is from the nearest face, and the direction away; NaN outside.

    Distances have a fold at a face, half their squares do not: near a face its place comes from
    their slope and its direction from their curvature, so the distance has a sign.
    """
    column, row = column - 0.5, row - 0.5
    i, j = math.floor(row), math.floor(column)
    if i < 1 or j < 1 or i + 2 >= field.shape[0] or j + 2 >= field.shape[1]:
        return math.nan, 0.0, 0.0
    d, gx, gy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(i, i + 2):
        for b in range(j, j + 2):
            w = (1.0 - abs(row - a)) * (1.0 - abs(column - b))
            mid, left, right = field[a, b], field[a, b - 1] ** 2, field[a, b + 1] ** 2
            low, high = field[a - 1, b] ** 2, field[a + 1, b] ** 2
            d += w * mid
            gx += 0.25 * w * (right - left)
            gy += 0.25 * w * (high - low)
            xx += 0.5 * w * (right + left - 2.0 * mid**2)
            yy += 0.5 * w * (high + low - 2.0 * mid**2)
            rising = field[a + 1, b + 1] ** 2 + field[a - 1, b - 1] ** 2
            xy += 0.125 * w * (rising - field[a + 1, b - 1] ** 2 - field[a - 1, b + 1] ** 2)
    if d > NEAR_CELLS * cell_m:
        size = max(math.hypot(gx, gy), 1e-12)
        return d, gx / size, gy / size
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    nx, ny = math.cos(angle), math.sin(angle)
    return (gx * nx + gy * ny) / cell_m, nx, ny


@array_kernel
def _refined(
    points: Floats, to_face: Floats, cell_m: float, x_m: float, y_m: float, begin: Floats,
    guess: Floats, std: Floats,
) -> tuple[Floats, Floats, float, int, float]:  # fmt: skip
    """Return pose, Hessian, variance of distances, how many are explained, sum of their squares."""
    pose, width = begin.copy(), WIDE_M
    distances = np.empty(len(points))
    hessian, variance, near, squares = np.zeros((3, 3)), 1.0, 0, 0.0
    for _ in range(ROUNDS):
        hessian, back = np.zeros((3, 3)), np.zeros(3)
        weights, weighted, near, squares = 0.0, 0.0, 0, 0.0
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for k in range(len(points)):
            rx, ry = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
            d, nx, ny = _from_face(
                to_face, cell_m, (pose[0] + rx - x_m) / cell_m, (pose[1] + ry - y_m) / cell_m
            )
            if math.isnan(d):
                continue
            if abs(d) <= EXPLAINED_M:
                distances[near] = abs(d)
                near += 1
                squares += d * d
            w = (width * width / (width * width + d * d)) ** 2
            row = (nx, ny, ny * rx - nx * ry)
            for p in range(3):
                back[p] -= w * row[p] * d
                for q in range(3):
                    hessian[p, q] += w * row[p] * row[q]
            weights += w
            weighted += w * d * d
        if near < MIN_POINTS:
            return begin, np.zeros((3, 3)), 1.0, near, squares
        spread = 1.5 * np.median(distances[:near])
        variance = max(weighted / max(weights - 3.0, 1.0), (0.1 * cell_m) ** 2)
        normal = hessian.copy()
        for p in range(3):
            normal[p, p] += variance / std[p] ** 2
            back[p] += variance / std[p] ** 2 * (guess[p] - pose[p])
        move = np.linalg.solve(normal, back)
        pose += move
        floor = max(3.0 * spread, NARROW_M)
        if np.abs(move).max() < CONVERGED and width <= 1.01 * floor:
            break
        width = min(max(0.7 * width, floor), WIDE_M)
    return pose, hessian, variance, near, squares
