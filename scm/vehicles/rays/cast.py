"""What level scanners see from where they are, all beams of a turn at one instant.

Each face is drawn into the beams it can be seen by, and every beam keeps the nearest:

    range = (a x d) / (u x d)        a: the face's start seen from the scanner, d: its direction,
                                     u: direction of the beam, x: cross product in the plane

Cells are looked at from near to far. A cell is passed over when all beams that could meet it have
met something nearer, and the turn is done when that holds for all beams. Results are those of every
beam against every face. A beam that passes a corner within 1e-9 rad meets both its faces.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.jit import array_kernel, law
from scm.vehicles.rays.grid import Cells, Numbers, cell_size, sort_bodies
from scm.vehicles.rays.order import SECTORS, WIDTH, Bits, Order, Sectors, order_of, sectors_of
from scm.vehicles.rays.scene import Scene

CORNER = 1e-9
EDGE_ON = 1e-12  # so is a face through the scanner itself
MARGIN = 3e-5
ALL, NONE, ONE = np.uint64(2**SECTORS - 1), np.uint64(0), np.uint64(1)
TURN = 2.0 * math.pi


def cast(
    scene: Scene, scanners: Floats, own: Ints, bearings: tuple[float, float, int], farthest: float
) -> Floats:
    """Return the ranges (k, beams) of scanners (k, 3) x, y, yaw; infinity is a miss.

    Args:
        scene: What stands around.
        scanners: Map frame [m, rad].
        own: (k,) slots of the cars they stand on, which they do not see; -1: of none.
        bearings: Of the first beam, from each to the next [rad], and how many.
        farthest: Reach [m].
    """
    first, step, beams = bearings
    angles = first + step * np.arange(beams)
    ranges = np.full((len(scanners), beams), np.inf)
    walls, bodies = sorted_scene(scene, scanners[:, :2], farthest)
    _cast(
        ranges, np.cos(angles), np.sin(angles), first, step, scanners, own, farthest,
        order_of(walls.size, farthest), sectors_of(step, beams), scene.walls.edges, walls,
        scene.outlines, scene.owners, bodies,
    )  # fmt: skip
    return ranges


def sorted_scene(scene: Scene, places: Floats, farthest: float) -> tuple[Cells, Cells]:
    """Return walls and bodies by cells, for scanners at places (k, 2)."""
    size = cell_size(farthest)
    finite = places[np.isfinite(places).all(axis=1)]
    if len(finite) == 0:
        finite = np.zeros((1, 2))
    low, high = finite.min(axis=0) - farthest, finite.max(axis=0) + farthest
    return scene.walls.cells(size), sort_bodies(scene.outlines, size, low, high)


class Turn(NamedTuple):
    """One scanner's turn under way.

    Attributes:
        ranges: (beams,) the nearest so far.
        open: (1,) bit s is set while a beam of sector s, from beam 0, may still see farther.
        sectors: The beams of each.
        ux, uy: (beams,) directions of the beams, map frame.
        zero: Bearing of beam 0, map frame; `step` from each beam to the next.
        x, y: Place of the scanner.
        farthest: Reach.
    """

    ranges: Floats
    open: Bits
    sectors: Sectors
    ux: Floats
    uy: Floats
    zero: float
    step: float
    x: float
    y: float
    farthest: float


@array_kernel
def _cast(
    ranges: Floats, ux: Floats, uy: Floats, first: float, step: float, scanners: Floats, own: Ints,
    farthest: float, order: Order, sectors: Sectors, edges: Floats, walls: Cells, outlines: Floats,
    owners: Ints, bodies: Cells,
) -> None:  # fmt: skip
    beams = ranges.shape[1]
    open_sectors = np.empty(1, np.uint64)
    wx, wy = np.empty(beams), np.empty(beams)
    wall_seen = np.full(edges.shape[0], -1, np.int32)
    body_seen = np.full(owners.shape[0], -1, np.int32)
    for k in range(scanners.shape[0]):
        x, y, yaw = scanners[k, 0], scanners[k, 1], scanners[k, 2]
        if not math.isfinite(x + y + yaw):
            continue
        c, s = math.cos(yaw), math.sin(yaw)
        for b in range(beams):
            wx[b] = c * ux[b] - s * uy[b]
            wy[b] = s * ux[b] + c * uy[b]
        open_sectors[0] = ALL
        turn = Turn(ranges[k], open_sectors, sectors, wx, wy, yaw + first, step, x, y, farthest)
        _look_around(turn, k, own[k], order, edges, walls, wall_seen, outlines, owners, bodies,
                     body_seen)  # fmt: skip


@law
def _look_around(
    turn: Turn, k: int, own: int, order: Order, edges: Floats, walls: Cells, wall_seen: Numbers,
    outlines: Floats, owners: Ints, bodies: Cells, body_seen: Numbers,
) -> None:  # fmt: skip
    """Look into all cells that may hold something nearer than what each beam has met."""
    i, j = math.floor(turn.x / walls.size), math.floor(turn.y / walls.size)
    reached = 0.0
    bearings = ALL
    for t in range(len(order.near)):
        if order.near[t] > reached:
            reached = order.near[t] + 0.5 * walls.size
            bearings = _close(turn, order.near[t])
            if bearings == NONE:
                break
        if (bearings & order.sectors[t]) == NONE:
            continue
        wall = _cell(walls, i + order.i[t], j + order.j[t])
        for n in range(walls.starts[wall], walls.starts[wall + 1] if wall >= 0 else 0):
            m = walls.items[n]
            if wall_seen[m] != k:
                wall_seen[m] = k
                _draw(turn, edges[m, 0], edges[m, 1], edges[m, 2], edges[m, 3])
        body = _cell(bodies, i + order.i[t], j + order.j[t])
        for n in range(bodies.starts[body], bodies.starts[body + 1] if body >= 0 else 0):
            m = bodies.items[n]
            if body_seen[m] != k and (owners[m] < 0 or owners[m] != own):
                body_seen[m] = k
                _draw_body(turn, outlines, 4 * m)


@law
def _close(turn: Turn, near: float) -> np.uint64:
    """Close the sectors that see nothing beyond `near`; return those of the map still open."""
    still = turn.open[0]
    for sector in range(SECTORS):
        bit = ONE << np.uint64(sector)
        if (still & bit) != NONE:
            b, end = turn.sectors.begin[sector], turn.sectors.end[sector]
            while b < end and turn.ranges[b] <= near:
                b += 1
            if b == end:
                still ^= bit
    turn.open[0] = still
    # a sector about the scanner lies across two of the map
    ahead = math.floor(turn.zero / WIDTH)
    return _rotated(still, ahead) | _rotated(still, ahead + 1)


@law
def _rotated(bits: np.uint64, by: int) -> np.uint64:
    left = np.uint64(by % SECTORS)
    right = np.uint64((SECTORS - by % SECTORS) % SECTORS)
    return (bits << left) | (bits >> right)


@law
def _cell(cells: Cells, i: int, j: int) -> int:
    """Return the number of a cell that something is in; -1 where nothing is."""
    a, b = i - cells.i0, j - cells.j0
    if a < 0 or a >= cells.ni or b < 0 or b >= cells.nj:
        return -1
    cell = a * cells.nj + b
    return cell if cells.starts[cell] < cells.starts[cell + 1] else -1


@law
def _draw_body(turn: Turn, outlines: Floats, first: int) -> None:
    """Draw the faces of a body that look towards the scanner; from inside it, all."""
    outside = False
    for n in range(first, first + 4):
        outside = outside or _looks_here(turn, outlines, n)
    for n in range(first, first + 4):
        if not outside or _looks_here(turn, outlines, n):
            _draw(turn, outlines[n, 0], outlines[n, 1], outlines[n, 2], outlines[n, 3])


@law
def _looks_here(turn: Turn, faces: Floats, n: int) -> bool:
    """Return whether the scanner stands outside a face, which is on its right-hand side."""
    ax, ay = faces[n, 0] - turn.x, faces[n, 1] - turn.y
    return bool(ax * (faces[n, 3] - turn.y) - ay * (faces[n, 2] - turn.x) < 0.0)


@law
def _draw(turn: Turn, x0: float, y0: float, x1: float, y1: float) -> None:
    """Lower the ranges of all beams that meet the face between two points of the map."""
    ax, ay, bx, by = x0 - turn.x, y0 - turn.y, x1 - turn.x, y1 - turn.y
    reach = turn.farthest
    if min(ax, bx) > reach or max(ax, bx) < -reach or min(ay, by) > reach or max(ay, by) < -reach:
        return
    moment = ax * by - ay * bx
    if moment < 0.0:
        ax, ay, bx, by, moment = bx, by, ax, ay, -moment
    if moment <= EDGE_ON:
        return
    start = bearing(ax, ay) - MARGIN
    span = bearing(bx, by) + MARGIN - start
    span -= TURN * math.floor(span / TURN)
    start -= turn.zero
    start -= TURN * math.floor(start / TURN)
    for _ in range(2):
        low = max(math.ceil(start / turn.step), 0)
        high = min(math.floor((start + span) / turn.step), len(turn.ranges) - 1)
        if low <= high:
            _lower(turn, low, high, ax, ay, bx, by, moment)
        start -= TURN


@law
def _lower(
    turn: Turn, low: int, high: int, ax: float, ay: float, bx: float, by: float, moment: float
) -> None:
    """Lower the ranges of those beams, low to high, that pass between a and b."""
    ranges, ux, uy = turn.ranges, turn.ux, turn.uy
    dx, dy = bx - ax, by - ay
    slack_a, slack_b = -CORNER * (abs(ax) + abs(ay)), -CORNER * (abs(bx) + abs(by))
    for b in range(low, high + 1):
        across = ux[b] * dy - uy[b] * dx
        after_a, before_b = ax * uy[b] - ay * ux[b], ux[b] * by - uy[b] * bx
        met = (across > 0.0) & (after_a >= slack_a) & (before_b >= slack_b)
        distance = moment / across if met else np.inf
        distance = distance if distance <= turn.farthest else np.inf
        ranges[b] = min(ranges[b], distance)


@law
def bearing(x: float, y: float) -> float:
    """Return the angle of a vector from the x axis to 2e-5 rad [rad]."""
    a, b = abs(x), abs(y)
    low, high = min(a, b), max(a, b)
    r = low / high if high > 0.0 else 0.0
    q = r * r
    angle = r * (0.9998660 + q * (-0.3302995 + q * (0.1801410 + q * (-0.0851330 + q * 0.0208351))))
    angle = 0.5 * math.pi - angle if b > a else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
