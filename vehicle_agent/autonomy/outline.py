"""Whether a car's outline is free at a pose, on a grid of clearances.

Four circles cover the outline. A circle whose middle has more clearance than its radius is free.
Else its piece of the outline is halved until each half is free by its own circle, or holds a point
nearer to an obstacle than the margin. So a gap counts as the outline needs it, to `FINEST_M`.
Holds: margins from one cell of the grid on; a thinner obstacle can lie between two cells' middles.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2
from scm.vehicles.jit import array_kernel, inlined, kernel_function
from vehicle_agent.autonomy.grid_map import GridMap, value_at
from vehicle_agent.autonomy.plan import CarLimits

FINEST_M = 0.004  # a piece this small that is not surely free is not free
DEEPEST = 64  # pieces that wait to be looked at
DEEPEST_OVERLAP_M = 1.0  # that `outline_clearance` tells apart


class Scene(NamedTuple):
    """A car on a grid, as kernels use it.

    Attributes:
        clearance: Of the grid, (rows, columns) [m].
        cell_m, x_m, y_m: Of the grid.
        middles: Of the circles, ahead of the rear axle (n,) [m]; `radius_m`: theirs.
        right_m, left_m: Edges of the outline.
        half_piece_m: Half the length of the piece that a circle covers.
        waiting: (DEEPEST, 4) work space.
    """

    clearance: Floats
    cell_m: float
    x_m: float
    y_m: float
    middles: Floats
    radius_m: float
    right_m: float
    left_m: float
    half_piece_m: float
    waiting: Floats


def scene_of(grid: GridMap, limits: CarLimits) -> Scene:
    """Return a car on a grid."""
    middles, radius = limits.circles()
    half = 0.5 * (limits.front_m - limits.rear_m) / len(middles)
    return Scene(
        grid.clearance_m, grid.cell_m, grid.x_m, grid.y_m, middles, radius, limits.right_m,
        limits.left_m, half, np.empty((DEEPEST, 4)),
    )  # fmt: skip


@inlined
def clearance_at(scene: Scene, x: float, y: float) -> float:
    """Return the clearance of a point [m], NaN outside the grid."""
    return value_at(scene.clearance, (x - scene.x_m) / scene.cell_m, (y - scene.y_m) / scene.cell_m)


@kernel_function
def _is_piece_free(
    scene: Scene, x: float, y: float, c: float, s: float, middle: float, margin: float
) -> bool:
    """Return whether a circle's piece of the outline keeps the margin, by halving it."""
    waiting = scene.waiting
    waiting[0, 0], waiting[0, 1] = middle, 0.5 * (scene.left_m + scene.right_m)
    waiting[0, 2], waiting[0, 3] = scene.half_piece_m, 0.5 * (scene.left_m - scene.right_m)
    count = 1
    while count > 0:
        count -= 1
        u, v, half, wide = waiting[count]
        clearance = clearance_at(scene, x + c * u - s * v, y + s * u + c * v)
        if clearance >= math.hypot(half, wide) + margin:
            continue
        nearest = min(half, wide)
        if not clearance >= nearest + margin or nearest < FINEST_M:
            return False
        along = half >= wide
        du, dv = (0.5 * half, 0.0) if along else (0.0, 0.5 * wide)
        half, wide = (0.5 * half, wide) if along else (half, 0.5 * wide)
        for sign in (-1.0, 1.0):
            waiting[count, 0], waiting[count, 1] = u + sign * du, v + sign * dv
            waiting[count, 2], waiting[count, 3] = half, wide
            count += 1
    return True


@kernel_function
def room_at(scene: Scene, x: float, y: float, yaw: float, margin: float) -> float:
    """Return the room beside a car, minus infinity where its outline does not keep the margin.

    Room is the least clearance of the circles' middles, less half of the outline's width [m].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    least = math.inf
    for middle in scene.middles:
        clearance = clearance_at(scene, x + c * middle, y + s * middle)
        if not clearance >= scene.radius_m + margin and not _is_piece_free(
            scene, x, y, c, s, middle, margin
        ):
            return -math.inf
        least = min(least, clearance)
    return least - 0.5 * (scene.left_m - scene.right_m)


@array_kernel
def _are_free(scene: Scene, poses: Floats, margin: float) -> Floats:
    room = np.empty(len(poses))
    for i in range(len(poses)):
        room[i] = room_at(scene, poses[i, 0], poses[i, 1], poses[i, 2], margin)
    return room


@array_kernel
def _clearance(scene: Scene, x: float, y: float, yaw: float) -> float:
    low, high = -DEEPEST_OVERLAP_M, DEEPEST_OVERLAP_M
    while high - low > 1e-4:
        margin = 0.5 * (low + high)
        free = room_at(scene, x, y, yaw, margin) > -math.inf
        low, high = (margin, high) if free else (low, margin)
    return low


def room(scene: Scene, poses: Floats, margin_m: float) -> Floats:
    """Return `room_at` of poses (n, 3): (n,), minus infinity where it is below the margin."""
    return _are_free(scene, poses, margin_m)


def outline_clearance(scene: Scene, pose: Pose2) -> float:
    """Return the greatest margin that a pose keeps [m]; negative: so deep in an obstacle."""
    return _clearance(scene, pose.x, pose.y, pose.yaw)
