"""What level scanners see while they move: every beam from its own place, at its own time.

A turn goes counter-clockwise and is over at the reading's instant: of n beams that share a whole
circle of duration T, beam i looked (n - 1 - i) T / n before. The scanner's pose then is the present
one taken back along its present motion, a steady turn of yaw rate w at velocity v:

    yaw_i = yaw - w t        place_i = place - R(yaw - w t / 2) v t sin(w t / 2) / (w t / 2)

Each beam walks through the cells that it crosses, in order, until what it has met is nearer than
the next cell. Everything else stands where it is at the reading's instant.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.jit import array_kernel, inlined
from scm.vehicles.rays.cast import CORNER, EDGE_ON, near_each_other, sorted_scene
from scm.vehicles.rays.grid import Numbers, Window
from scm.vehicles.rays.scene import Scene

SLOW = 1e-9
FASTEST = 100.0  # a reported motion may be anything


def march(
    scene: Scene,
    scanners: Floats,
    motion: Floats,
    own: Ints,
    bearings: tuple[float, float, int],
    farthest: float,
    period_s: float,
) -> Floats:
    """Return the ranges (k, beams) of scanners that move; as `cast` else.

    Args:
        scene: What stands around.
        scanners: (k, 3) x, y, yaw at the end of the turn, map frame [m, rad].
        motion: (k, 3) velocity of the scanner along and across the body, yaw rate [m/s, rad/s].
        own: (k,) slots of the cars they stand on.
        bearings: Of the first beam, from each to the next [rad], and how many.
        farthest: Reach [m].
        period_s: How long a whole circle takes.
    """
    first, step, beams = bearings
    ago: Floats = np.arange(beams - 1.0, -1.0, -1.0) * (step / (2.0 * math.pi) * period_s)
    places = past_poses(scanners, motion, ago)
    places[:, :, 2] += first + step * np.arange(beams)
    ranges: Floats = np.full((len(scanners), beams), np.inf)
    for some in near_each_other(scanners[:, :2], farthest):
        seen = np.full((len(some), beams), np.inf)
        walls, bodies = sorted_scene(scene, places[some, :, :2].reshape(-1, 2), farthest)
        _march(
            seen, places[some], own[some], farthest, scene.walls.edges, *walls, scene.outlines,
            scene.owners, *bodies,
        )  # fmt: skip
        ranges[some] = seen
    return ranges


def past_poses(scanners: Floats, motion: Floats, ago: Floats) -> Floats:
    """Return where scanners (k, 3) were some times ago (b,), (k, b, 3), in steady motion."""
    steady = np.clip(np.nan_to_num(motion), -FASTEST, FASTEST)
    along, across, rate = (column[:, None] for column in steady.T)
    x, y, yaw = (column[:, None] for column in scanners.T)
    half = 0.5 * rate * ago
    way = ago * np.sinc(half / math.pi)
    c, s = np.cos(yaw - half), np.sin(yaw - half)
    return np.stack(
        (x - way * (c * along - s * across), y - way * (s * along + c * across), yaw - 2.0 * half),
        axis=2,
    )


@array_kernel
def _march(
    ranges: Floats, places: Floats, own: Ints, farthest: float, edges: Floats, walls: Window,
    wall_starts: Numbers, wall_items: Numbers, outlines: Floats, owners: Ints, bodies: Window,
    body_starts: Numbers, body_items: Numbers,
) -> None:  # fmt: skip
    for k in range(places.shape[0]):
        for b in range(places.shape[1]):
            x, y, angle = places[k, b, 0], places[k, b, 1], places[k, b, 2]
            if not math.isfinite(x + y + angle):
                continue
            ux, uy = math.cos(angle), math.sin(angle)
            i, j = math.floor(x / walls.size), math.floor(y / walls.size)
            to_i, a_cell_i = _to_border(x, ux, i, walls.size)
            to_j, a_cell_j = _to_border(y, uy, j, walls.size)
            gone, nearest = 0.0, farthest
            while gone <= nearest:
                begin, end = _items_of_cell(walls, wall_starts, i, j)
                for n in range(begin, end):
                    nearest = min(nearest, _meet(x, y, ux, uy, edges, wall_items[n]))
                begin, end = _items_of_cell(bodies, body_starts, i, j)
                for n in range(begin, end):
                    m = body_items[n]
                    if owners[m] < 0 or owners[m] != own[k]:
                        nearest = min(nearest, _meet_body(x, y, ux, uy, outlines, 4 * m))
                gone = min(to_i, to_j)
                if to_i <= to_j:
                    to_i, i = to_i + a_cell_i, i + (1 if ux > 0.0 else -1)
                else:
                    to_j, j = to_j + a_cell_j, j + (1 if uy > 0.0 else -1)
            ranges[k, b] = nearest if nearest < farthest else np.inf


@inlined
def _meet_body(x: float, y: float, ux: float, uy: float, outlines: Floats, first: int) -> float:
    """Return how far along a beam it meets a body; infinity where it does not."""
    nearest = math.inf
    for face in range(first, first + 4):
        nearest = min(nearest, _meet(x, y, ux, uy, outlines, face))
    return nearest


@inlined
def _to_border(x: float, u: float, cell: int, size: float) -> tuple[float, float]:
    """Return how far along a beam the next border of cells is, and how far apart they are."""
    if abs(u) < SLOW:
        return math.inf, math.inf
    border = (cell + 1) * size if u > 0.0 else cell * size
    return (border - x) / u, size / abs(u)


@inlined
def _items_of_cell(window: Window, starts: Numbers, i: int, j: int) -> tuple[int, int]:
    """Return where the items of a cell begin and end."""
    a, b = i - window.i0, j - window.j0
    if a < 0 or a >= window.ni or b < 0 or b >= window.nj:
        return 0, 0
    cell = a * window.nj + b
    return starts[cell], starts[cell + 1]


@inlined
def _meet(x: float, y: float, ux: float, uy: float, faces: Floats, m: int) -> float:
    """Return how far along a beam it meets a face; infinity where it does not."""
    ax, ay = faces[m, 0] - x, faces[m, 1] - y
    bx, by = faces[m, 2] - x, faces[m, 3] - y
    after_a, before_b = ax * uy - ay * ux, ux * by - uy * bx
    moment, across = ax * by - ay * bx, ux * (by - ay) - uy * (bx - ax)
    if moment < 0.0:
        moment, across, after_a, before_b = -moment, -across, -after_a, -before_b
    slack = -CORNER * (abs(ax) + abs(ay) + abs(bx) + abs(by))
    if moment <= EDGE_ON or across <= 0.0 or min(after_a, before_b) < slack:
        return math.inf
    return float(moment / across)
