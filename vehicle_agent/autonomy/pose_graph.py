"""Poses that agree best with how they were measured from each other: Gauss-Newton, dense.

Of an edge that says pose j is `motion` seen from pose i, the error in i's frame is

    e = (R(-yaw_i) (p_j - p_i) - motion_xy,  yaw_j - yaw_i - motion_yaw)

and the sum of s^2 e' W e over all edges is minimised, the first pose held. Edges of loop closures
that disagree with all others lose weight, s = min(1, 2 F / (F + e' W e)); F is `FREE`.
Holds: below some 1000 poses; beyond that a sparse solver is needed.
Sources: Grisetti et al., "A tutorial on graph-based SLAM", 2010; dynamic covariance scaling,
Agarwal et al., ICRA 2013.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.geometry import Pose2, wrap_angle

ROUNDS = 10
CONVERGED = 1e-5  # [m, rad]
FREE = 10.0  # of an edge's squared error, before it loses weight


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """What was measured between two poses.

    Attributes:
        i, j: Their numbers.
        motion: Pose j seen from pose i.
        information: Inverse of its covariance, (3, 3) [1/m, 1/m, 1/rad].
        is_loop: Whether it may be wrong.
    """

    i: int
    j: int
    motion: Pose2
    information: Floats
    is_loop: bool = False


def optimized(poses: Sequence[Pose2], edges: Sequence[Edge]) -> list[Pose2]:
    """Return the poses that agree best with all edges; the first stays where it is."""
    at = np.array(poses, dtype=np.float64).reshape(-1, 3)
    for _ in range(ROUNDS):
        normal, back = np.zeros((at.size, at.size)), np.zeros(at.size)
        normal[:3, :3] = 1e12 * np.eye(3)
        for edge in edges:
            error, rows = _error(at[edge.i], at[edge.j], edge.motion)
            square = float(error @ edge.information @ error)
            scale = min(1.0, 2.0 * FREE / (FREE + square)) if edge.is_loop else 1.0
            weighted = rows.T @ edge.information * scale**2
            columns = np.r_[3 * edge.i : 3 * edge.i + 3, 3 * edge.j : 3 * edge.j + 3]
            normal[np.ix_(columns, columns)] += weighted @ rows
            back[columns] -= weighted @ error
        move = np.linalg.solve(normal, back).reshape(-1, 3)
        at += move
        if np.abs(move).max() < CONVERGED:
            break
    return [Pose2(float(x), float(y), wrap_angle(float(yaw))) for x, y, yaw in at]


def _error(first: Floats, second: Floats, motion: Pose2) -> tuple[Floats, Floats]:
    """Return an edge's error (3,), and its derivatives by both poses (3, 6)."""
    c, s = math.cos(first[2]), math.sin(first[2])
    dx, dy = second[0] - first[0], second[1] - first[1]
    along, across = c * dx + s * dy, c * dy - s * dx
    turn = wrap_angle(float(second[2] - first[2] - motion.yaw))
    error = np.array((along - motion.x, across - motion.y, turn))
    rows = np.array((
        (-c, -s, across, c, s, 0.0),
        (s, -c, -along, -s, c, 0.0),
        (0.0, 0.0, -1.0, 0.0, 0.0, 1.0),
    ))  # fmt: skip
    return error, rows
