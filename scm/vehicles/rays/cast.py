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
from scm.vehicles.jit import array_kernel, inlined
from scm.vehicles.rays.grid import Cells, Numbers, Window, cell_size, fits, sort_bodies, window_of
from scm.vehicles.rays.order import SECTORS, WIDTH, Order, Sectors, order_of, sectors_of
from scm.vehicles.rays.scene import Scene

CORNER = 1e-9
EDGE_ON = 1e-12  # so is a face through the scanner itself
MARGIN = 3e-5
CELLS_A_TILE = 1000
FARTHEST_OUT = 1e8  # cells are counted in 32 bits
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
    angles = step * np.arange(beams)
    lines = np.stack((angles, np.cos(angles), np.sin(angles)))
    ranges: Floats = np.full((len(scanners), beams), np.inf)
    for some in near_each_other(scanners[:, :2], farthest):
        seen = np.full((len(some), beams), np.inf)
        walls, bodies = sorted_scene(scene, scanners[some, :2], farthest)
        _cast(
            seen, lines, first, step, scanners[some], own[some], farthest,
            order_of(walls.window.size, farthest), sectors_of(step, beams), scene.walls.edges,
            *walls, scene.outlines, scene.owners, *bodies,
            np.full(len(scene.walls.edges), -1, np.int32),
            np.full(len(scene.owners), -1, np.int32),
        )  # fmt: skip
        ranges[some] = seen
    return ranges


def sorted_scene(scene: Scene, places: Floats, farthest: float) -> tuple[Cells, Cells]:
    """Return walls and bodies by cells, for scanners at places (k, 2)."""
    size = cell_size(farthest)
    window = window_of(places, size, farthest)
    return scene.walls.cells(size, window), sort_bodies(scene.outlines, window)


def near_each_other(places: Floats, farthest: float) -> list[Ints]:
    """Return the scanners (k, 2) in batches, each in a window that can be laid out; most often one.

    Scanners whose place is no number, or is beyond counting, are in none.
    """
    size = cell_size(farthest)
    usable = np.flatnonzero((np.abs(places) < FARTHEST_OUT).all(axis=1))
    if len(usable) == 0:
        return []
    if fits(window_of(places[usable], size, farthest)):
        return [usable]
    tiles = np.floor(places[usable] / (CELLS_A_TILE * size))
    _, tile = np.unique(tiles, axis=0, return_inverse=True)
    return [usable[tile == number] for number in range(tile.max() + 1)]


class Turn(NamedTuple):
    """One scanner's turn; its frame has x along beam 0 and y to the left of it.

    Attributes:
        x, y: Place of the scanner, map frame.
        c, s: Cosine and sine of beam 0's bearing, map frame.
        a_step: Beams in a radian.
        reach: The farthest that a range can be.
    """

    x: float
    y: float
    c: float
    s: float
    a_step: float
    reach: float


@array_kernel
def _cast(
    ranges: Floats, beams: Floats, first: float, step: float, scanners: Floats, own: Ints,
    farthest: float, order: Order, sectors: Sectors, edges: Floats, walls: Window,
    wall_starts: Numbers, wall_items: Numbers, outlines: Floats, owners: Ints, bodies: Window,
    body_starts: Numbers, body_items: Numbers, wall_seen: Numbers, body_seen: Numbers,
) -> None:  # fmt: skip
    """Fill `ranges`, a row a turn.

    `beams` (3, n) has room for a turn's ranges above the directions of the beams. In `wall_seen`
    and `body_seen` stands which turn drew each last; all begin with -1.
    """
    for k in range(scanners.shape[0]):
        x, y, zero = scanners[k, 0], scanners[k, 1], scanners[k, 2] + first
        if not math.isfinite(zero):
            continue
        _begin(beams)
        turn = Turn(x, y, math.cos(zero), math.sin(zero), 1.0 / step, farthest)
        i, j = math.floor(x / walls.size), math.floor(y / walls.size)
        ahead = math.floor(zero / WIDTH)
        still, open_bearings, reached = ALL, ALL, 0.0
        for t in range(len(order.near)):
            if order.near[t] > reached:
                reached = order.near[t] + walls.size
                still = _close(still, sectors.begin, sectors.end, beams, order.near[t])
                if still == NONE:
                    break
                # a sector about the scanner lies across two of the map
                open_bearings = _rotated(still, ahead) | _rotated(still, ahead + 1)
            if (open_bearings & order.sectors[t]) != NONE:
                cell = _cell(
                    i - walls.i0 + order.i[t], j - walls.j0 + order.j[t], walls.ni, walls.nj
                )
                if cell >= 0 and wall_starts[cell] < wall_starts[cell + 1]:
                    _look_at_walls(beams, turn, k, edges, wall_starts[cell],
                                   wall_starts[cell + 1], wall_items, wall_seen)  # fmt: skip
                cell = _cell(
                    i - bodies.i0 + order.i[t], j - bodies.j0 + order.j[t], bodies.ni, bodies.nj
                )
                if cell >= 0 and body_starts[cell] < body_starts[cell + 1]:
                    _look_at_bodies(beams, turn, k, own[k], outlines, owners, body_starts[cell],
                                    body_starts[cell + 1], body_items, body_seen)  # fmt: skip
        _keep(beams, ranges, k)


@inlined
def _begin(beams: Floats) -> None:
    for b in range(beams.shape[1]):  # a plain loop: numba takes 2 s to compile `beams[0] = inf`
        beams[0, b] = np.inf


@inlined
def _keep(beams: Floats, ranges: Floats, k: int) -> None:
    for b in range(beams.shape[1]):
        ranges[k, b] = beams[0, b]


@inlined
def _close(still: np.uint64, begin: Numbers, end: Numbers, beams: Floats, near: float) -> np.uint64:
    """Return the sectors, from beam 0, that still see beyond `near`, of those that did."""
    for sector in range(SECTORS):
        bit = ONE << np.uint64(sector)
        if (still & bit) != NONE:
            b = begin[sector]
            while b < end[sector] and beams[0, b] <= near:
                b += 1
            if b == end[sector]:
                still ^= bit
    return still


@inlined
def _rotated(bits: np.uint64, by: int) -> np.uint64:
    left = np.uint64(by % SECTORS)
    right = np.uint64((SECTORS - by % SECTORS) % SECTORS)
    return (bits << left) | (bits >> right)


@inlined
def _look_at_walls(
    beams: Floats, turn: Turn, k: int, edges: Floats, begin: int, end: int, items: Numbers,
    seen: Numbers,
) -> None:  # fmt: skip
    """Draw those walls of a cell that turn k has not drawn yet."""
    for n in range(begin, end):
        m = items[n]
        if seen[m] != k:
            seen[m] = k
            ax, ay = _seen_from(turn, edges[m, 0], edges[m, 1])
            bx, by = _seen_from(turn, edges[m, 2], edges[m, 3])
            moment = ax * by - ay * bx
            if moment < 0.0:
                ax, ay, bx, by, moment = bx, by, ax, ay, -moment
            _draw(beams, turn.a_step, turn.reach, ax, ay, bx, by, moment)


@inlined
def _look_at_bodies(
    beams: Floats, turn: Turn, k: int, own: int, outlines: Floats, owners: Ints, begin: int,
    end: int, items: Numbers, seen: Numbers,
) -> None:  # fmt: skip
    """Draw those bodies of a cell that turn k has not drawn yet."""
    for n in range(begin, end):
        m = items[n]
        if seen[m] != k and (owners[m] < 0 or owners[m] != own):
            seen[m] = k
            _draw_body(beams, turn, outlines, 4 * m)


@inlined
def _cell(i: int, j: int, ni: int, nj: int) -> int:
    """Return the number of a cell of a window; -1 outside it."""
    return i * nj + j if (i >= 0) & (i < ni) & (j >= 0) & (j < nj) else -1


@inlined
def _seen_from(turn: Turn, x: float, y: float) -> tuple[float, float]:
    """Return a point of the map in the turn's frame."""
    dx, dy = x - turn.x, y - turn.y
    return turn.c * dx + turn.s * dy, turn.c * dy - turn.s * dx


@inlined
def _draw_body(beams: Floats, turn: Turn, outlines: Floats, first: int) -> None:
    """Draw the faces of a body that look towards the scanner; from inside it, all."""
    x0, y0 = _seen_from(turn, outlines[first, 0], outlines[first, 1])
    x1, y1 = _seen_from(turn, outlines[first + 1, 0], outlines[first + 1, 1])
    x2, y2 = _seen_from(turn, outlines[first + 2, 0], outlines[first + 2, 1])
    x3, y3 = _seen_from(turn, outlines[first + 3, 0], outlines[first + 3, 1])
    m0, m1 = x1 * y0 - y1 * x0, x2 * y1 - y2 * x1
    m2, m3 = x3 * y2 - y3 * x2, x0 * y3 - y0 * x3
    if max(m0, m1, m2, m3) <= 0.0:
        # from inside, the other way round
        x1, y1, x3, y3 = x3, y3, x1, y1
        m0, m1, m2, m3 = -m3, -m2, -m1, -m0
    for _ in range(4):
        if m0 > 0.0:
            _draw(beams, turn.a_step, turn.reach, x1, y1, x0, y0, m0)
        m0, m1, m2, m3 = m1, m2, m3, m0
        x0, y0, x1, y1, x2, y2, x3, y3 = x1, y1, x2, y2, x3, y3, x0, y0


@inlined
def _draw(
    beams: Floats, a_step: float, reach: float, ax: float, ay: float, bx: float, by: float,
    moment: float,
) -> None:  # fmt: skip
    """Lower the ranges of all beams that meet the face from a to b, counter-clockwise."""
    if (
        moment <= EDGE_ON
        or (min(ax, bx) > reach)
        or (max(ax, bx) < -reach)
        or (min(ay, by) > reach)
        or (max(ay, by) < -reach)
    ):
        return
    start = bearing(ax, ay) - MARGIN
    span = bearing(bx, by) + MARGIN - start
    span = span + TURN if span < 0.0 else span
    start = start + TURN if start < 0.0 else start
    last = beams.shape[1] - 1
    end = (start + span) * a_step
    _lower(
        beams,
        reach,
        math.ceil(start * a_step),
        min(math.floor(end), last),
        ax,
        ay,
        bx,
        by,
        moment,
    )
    if start + span >= TURN:
        begin, end = max(start - TURN, 0.0) * a_step, end - TURN * a_step
        _lower(beams, reach, math.ceil(begin), min(math.floor(end), last), ax, ay, bx, by, moment)


@inlined
def _lower(
    beams: Floats, reach: float, low: int, high: int, ax: float, ay: float, bx: float, by: float,
    moment: float,
) -> None:  # fmt: skip
    """Lower the ranges of those beams, low to high, that pass between a and b."""
    dx, dy = bx - ax, by - ay
    slack_a, slack_b = -CORNER * (abs(ax) + abs(ay)), -CORNER * (abs(bx) + abs(by))
    b = low
    while b <= high and ax * beams[2, b] - ay * beams[1, b] < slack_a:
        b += 1
    while b <= high and beams[1, b] * by - beams[2, b] * bx >= slack_b:
        across = beams[1, b] * dy - beams[2, b] * dx
        distance = moment / across if across > 0.0 else np.inf
        distance = distance if distance <= reach else np.inf
        beams[0, b] = min(beams[0, b], distance)
        b += 1


@inlined
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
