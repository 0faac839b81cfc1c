"""Broad phase of the contact step: which bodies may touch, compiled, for any number of bodies.

Bodies carry a circle about their centre of gravity. Lists of pairs whose circles come close are
made anew only when a body has moved by its leeway; between that each step looks at the listed pairs
alone, and marks those whose boxes really overlap. A lone car costs a few nanoseconds a step.

Lists hold all that may matter to a body, in ascending order, so what a step finds out about it
depends on those near it alone: neither on others' motion nor on when the lists were made.
"""

import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.vehicles.jit import array_kernel, kernel_function
from scm.world.sweep import is_any_fast, share_moves

LEEWAY_M = 0.025  # a body may move before its pairs are listed anew
LOOK_AHEAD_S = 0.1  # added to the leeway, times its speed
TOUCH_M = 1e-4  # gap at which boxes count as overlapping; the solver decides
CELL_M = 0.5
PIECE_M = 2.0  # a longer wall is sorted into cells in pieces of this
MAX_CELLS = 4_000_000  # of the grid; larger cells on a larger map


class Obstacles(NamedTuple):
    """What never moves, as boxes, sorted into square cells.

    Attributes:
        boxes: (m, 6) x, y, cosine and sine of the length's direction, half length, half width.
        frame: x and y of the lower left of the cells, and their edge [m].
        cells: Columns and rows.
        starts: Where each cell's obstacles begin in `items`.
        items: Rows of `boxes`.
    """

    boxes: Floats
    frame: Floats
    cells: Ints
    starts: Ints
    items: Ints


def obstacles_of(boxes: Floats) -> Obstacles:
    """Sort boxes (m, 6) into cells; a long one goes only into those along its way."""
    if not len(boxes):
        frame, none = np.array([0.0, 0.0, CELL_M]), np.zeros(0, int)
        return Obstacles(boxes, frame, np.zeros(2, int), np.zeros(1, int), none)
    pieces = np.maximum(1, np.ceil(2.0 * boxes[:, 4] / PIECE_M)).astype(int)
    owner = np.repeat(np.arange(len(boxes)), pieces)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    x, y, c, s, length, width = boxes[owner].T
    piece = length / pieces[owner]
    along = -length + (2 * within + 1) * piece
    reach_x = np.abs(c) * piece + np.abs(s) * width
    reach_y = np.abs(s) * piece + np.abs(c) * width
    x, y = x + along * c, y + along * s
    low = np.array([(x - reach_x).min(), (y - reach_y).min()])
    high = np.array([(x + reach_x).max(), (y + reach_y).max()])
    edge = max(CELL_M, math.sqrt(float(np.prod(high - low)) / MAX_CELLS))
    columns, rows = (int(v) + 1 for v in (high - low) / edge)
    held: list[list[int]] = [[] for _ in range(columns * rows)]
    low_cells = ((np.column_stack((x - reach_x, y - reach_y)) - low) / edge).astype(int)
    high_cells = ((np.column_stack((x + reach_x, y + reach_y)) - low) / edge).astype(int)
    spans = np.column_stack((owner, low_cells, high_cells)).tolist()
    for i, left, lower, right, upper in spans:
        for row in range(lower, upper + 1):
            for column in range(left, right + 1):
                cell = held[row * columns + column]
                if not cell or cell[-1] != i:
                    cell.append(i)
    starts = np.cumsum([0, *map(len, held)])
    items = np.array([i for cell in held for i in cell], dtype=np.int64)
    return Obstacles(boxes, np.array([*low, edge]), np.array([columns, rows]), starts, items)


class BroadPhase:
    """Lists of pairs of a set of bodies, whose rows keep their order as bodies come and go."""

    def __init__(self, obstacles: Obstacles) -> None:
        self._obstacles = obstacles
        self._order: Ints = np.empty(0, np.int64)
        self._from: Floats = np.empty((0, 2))
        self._leeway: Floats = np.empty(0)
        self._pairs: Ints = np.empty((0, 2), np.int64)
        self._walls: Ints = np.empty((0, 2), np.int64)

    def touching(self, order: Ints, motion: Floats, outlines: Floats, first_box: int) -> Bools:
        """Return who overlaps somebody or something, (n,).

        Args:
            order: (n,) numbers that say who is who: lists are made anew when they change.
            motion: (n, 6) x, y, yaw, velocity x, y and yaw rate of centres of gravity.
            outlines: (n, 5) middle of the box ahead of and left of the centre of gravity, half
                length, half width, and radius of the circle.
            first_box: Rows from here on are boxes: two of them at rest do not count as touching.
        """
        if has_strayed(order, self._order, self._from, self._leeway, motion):
            leeway = LEEWAY_M + LOOK_AHEAD_S * np.hypot(motion[:, 3], motion[:, 4])
            self._list_anew(order, motion, leeway, outlines)
        marks = np.zeros(len(motion), np.bool_)
        mark(marks, self._pairs, self._walls, motion, outlines, self._obstacles.boxes, first_box)
        return marks

    def shares(
        self, starts: Floats, moves: Floats, outlines: Floats, boxes: Floats, marks: Bools
    ) -> Floats | None:
        """Return what share of its move each body can make, (n,); None where all make all of it.

        The rows are those that `touching` was called with last; the arguments are `share_moves`'s.
        """
        fast = is_any_fast(moves, outlines)
        if not (fast or marks.any()):
            return None
        if does_leave(self._from, self._leeway, starts, moves):
            leeway = LEEWAY_M + 2.0 * np.hypot(moves[:, 0], moves[:, 1])
            self._list_anew(self._order, starts, leeway, outlines)
        shares = np.ones(len(moves))
        share_moves(shares, self._pairs, self._walls, starts, moves, outlines, boxes, marks, fast)
        return shares if (shares < 1.0).any() else None

    def overlaps(self, motion: Floats, outlines: Floats, marks: Bools) -> Ints:
        """Return the pairs of rows (k, 2) of marked bodies that overlap, the lower row first.

        The arguments are those of `touching`, and what it returned.
        """
        found = np.empty_like(self._pairs)
        return found[: list_overlaps(found, self._pairs, marks, motion, outlines)]

    def _list_anew(self, order: Ints, places: Floats, leeway: Floats, outlines: Floats) -> None:
        self._order, self._from, self._leeway = order.copy(), places[:, :2].copy(), leeway
        reach = outlines[:, 4] + leeway + TOUCH_M
        room = max(64, 4 * len(order))
        head = np.zeros(_buckets(len(order)), np.int64)
        after, cells = np.zeros(len(order), np.int64), np.zeros((len(order), 2), np.int64)
        while True:
            self._pairs = np.empty((room, 2), np.int64)
            count = list_pairs(self._pairs, places, reach, head, after, cells)
            if count <= room:
                break
            room = 2 * count
        self._pairs = self._pairs[:count]
        self._walls = walls_near(places, reach, self._obstacles)


def walls_near(places: Floats, reach: Floats, obstacles: Obstacles) -> Ints:
    """Return rows and obstacles (k, 2) within reach (n,) of places (n, 2 or more), ascending."""
    room = max(64, 4 * len(reach))
    while True:
        walls = np.empty((room, 2), np.int64)
        count = list_walls(walls, places, reach, obstacles)
        if count <= room:
            return walls[:count]
        room = 2 * count


def _buckets(n: int) -> int:
    """Return how many heads of lists the bodies are spread over: a power of two."""
    return 1 << max(6, (2 * n - 1).bit_length())


@array_kernel
def has_strayed(order: Ints, known: Ints, begun: Floats, leeway: Floats, motion: Floats) -> bool:
    """Return whether others were listed, or any body is further from there than its leeway."""
    if order.shape[0] != known.shape[0]:
        return True
    for i in range(known.shape[0]):
        if order[i] != known[i]:
            return True
        dx, dy = motion[i, 0] - begun[i, 0], motion[i, 1] - begun[i, 1]
        if not dx * dx + dy * dy <= leeway[i] * leeway[i]:
            return True
    return False


@array_kernel
def does_leave(begun: Floats, leeway: Floats, starts: Floats, moves: Floats) -> bool:
    """Return whether any body begins or ends its move further from there than its leeway."""
    for i in range(begun.shape[0]):
        dx, dy = starts[i, 0] - begun[i, 0], starts[i, 1] - begun[i, 1]
        far = leeway[i] * leeway[i]
        if not dx * dx + dy * dy <= far:
            return True
        dx, dy = dx + moves[i, 0], dy + moves[i, 1]
        if not dx * dx + dy * dy <= far:
            return True
    return False


@kernel_function
def put_in_order(rows: Ints, begin: int, end: int, column: int) -> None:
    """Sort a few rows by a column, ascending; the other column is the same in all of them."""
    for k in range(begin + 1, end):
        value, place = rows[k, column], k
        while place > begin and rows[place - 1, column] > value:
            rows[place, column] = rows[place - 1, column]
            place -= 1
        rows[place, column] = value


@array_kernel
def list_pairs(
    pairs: Ints, motion: Floats, reach: Floats, head: Ints, after: Ints, places: Ints
) -> int:
    """Write the pairs whose circles overlap; return how many there are, written or not.

    They are in order of their higher row, then of their lower one, which comes first. `head`, a
    power of two long, `after` (n,) and `places` (n, 2) are room to work in.
    """
    n = reach.shape[0]
    widest = 0.01
    for i in range(n):
        widest = max(widest, reach[i])
    cell = 2.0 * widest
    size = head.shape[0]
    for bucket in range(size):
        head[bucket] = -1
    count = 0
    for i in range(n):
        column, row = math.floor(motion[i, 0] / cell), math.floor(motion[i, 1] / cell)
        begun = count
        for k in range(9):
            c, r = column + k % 3 - 1, row + k // 3 - 1
            j = head[(c * 73856093 ^ r * 19349663) & (size - 1)]
            while j >= 0:
                if places[j, 0] == c and places[j, 1] == r:
                    dx, dy = motion[i, 0] - motion[j, 0], motion[i, 1] - motion[j, 1]
                    far = reach[i] + reach[j]
                    if dx * dx + dy * dy < far * far:
                        if count < pairs.shape[0]:
                            pairs[count, 0], pairs[count, 1] = j, i
                        count += 1
                j = after[j]
        put_in_order(pairs, begun, min(count, pairs.shape[0]), 0)
        places[i, 0], places[i, 1] = column, row
        bucket = (column * 73856093 ^ row * 19349663) & (size - 1)
        after[i] = head[bucket]
        head[bucket] = i
    return count


@kernel_function
def gap_to_box(x: float, y: float, box: Floats) -> float:
    """Return the distance of a point to a box, squared [m^2]."""
    dx, dy = x - box[0], y - box[1]
    along = max(abs(box[2] * dx + box[3] * dy) - box[4], 0.0)
    across = max(abs(box[2] * dy - box[3] * dx) - box[5], 0.0)
    return float(along * along + across * across)


@array_kernel
def list_walls(walls: Ints, motion: Floats, reach: Floats, obstacles: Obstacles) -> int:
    """Write (body, obstacle) where a circle reaches an obstacle; return how many there are.

    They are in order of both.
    """
    frame, count = obstacles.frame, 0
    for i in range(reach.shape[0]):
        x, y, r = motion[i, 0], motion[i, 1], reach[i]
        left = max(math.floor((x - r - frame[0]) / frame[2]), 0)
        right = min(math.floor((x + r - frame[0]) / frame[2]), obstacles.cells[0] - 1)
        lower = max(math.floor((y - r - frame[1]) / frame[2]), 0)
        upper = min(math.floor((y + r - frame[1]) / frame[2]), obstacles.cells[1] - 1)
        begun = count
        for row in range(lower, upper + 1):
            for column in range(left, right + 1):
                cell = row * obstacles.cells[0] + column
                for k in range(obstacles.starts[cell], obstacles.starts[cell + 1]):
                    wall = obstacles.items[k]
                    if gap_to_box(x, y, obstacles.boxes[wall]) >= r * r:
                        continue
                    known = False
                    for before in range(begun, min(count, walls.shape[0])):
                        known = known or walls[before, 1] == wall
                    if known:
                        continue
                    if count < walls.shape[0]:
                        walls[count, 0], walls[count, 1] = i, wall
                    count += 1
        put_in_order(walls, begun, min(count, walls.shape[0]), 1)
    return count


@kernel_function
def is_apart(
    x: float, y: float, c: float, s: float, length: float, width: float,
    other_length: float, other_width: float,
) -> bool:  # fmt: skip
    """Return whether a box at (x, y), turned by (c, s), keeps clear of an upright one at 0."""
    turn_c, turn_s = abs(c), abs(s)
    return (
        abs(x) > other_length + turn_c * length + turn_s * width + TOUCH_M
        or abs(y) > other_width + turn_s * length + turn_c * width + TOUCH_M
        or abs(c * x + s * y) > length + turn_c * other_length + turn_s * other_width + TOUCH_M
        or abs(c * y - s * x) > width + turn_s * other_length + turn_c * other_width + TOUCH_M
    )


@kernel_function
def do_overlap(motion: Floats, outlines: Floats, i: int, j: int) -> bool:
    """Return whether two bodies' boxes overlap."""
    dx, dy = motion[j, 0] - motion[i, 0], motion[j, 1] - motion[i, 1]
    far = outlines[i, 4] + outlines[j, 4] + TOUCH_M
    if dx * dx + dy * dy > far * far:
        return False
    ci, si = math.cos(motion[i, 2]), math.sin(motion[i, 2])
    cj, sj = math.cos(motion[j, 2]), math.sin(motion[j, 2])
    c, s = ci * cj + si * sj, ci * sj - si * cj
    x = ci * dx + si * dy + c * outlines[j, 0] - s * outlines[j, 1] - outlines[i, 0]
    y = ci * dy - si * dx + s * outlines[j, 0] + c * outlines[j, 1] - outlines[i, 1]
    return not is_apart(x, y, c, s, outlines[j, 2], outlines[j, 3], outlines[i, 2], outlines[i, 3])


@kernel_function
def does_meet(motion: Floats, outlines: Floats, i: int, box: Floats) -> bool:
    """Return whether a body's box overlaps an obstacle."""
    far = outlines[i, 4] + TOUCH_M
    if gap_to_box(motion[i, 0], motion[i, 1], box) > far * far:
        return False
    ci, si = math.cos(motion[i, 2]), math.sin(motion[i, 2])
    dx = motion[i, 0] + ci * outlines[i, 0] - si * outlines[i, 1] - box[0]
    dy = motion[i, 1] + si * outlines[i, 0] + ci * outlines[i, 1] - box[1]
    c, s = box[2] * ci + box[3] * si, box[2] * si - box[3] * ci
    x, y = box[2] * dx + box[3] * dy, box[2] * dy - box[3] * dx
    return not is_apart(x, y, c, s, outlines[i, 2], outlines[i, 3], box[4], box[5])


@kernel_function
def is_moving(motion: Floats, i: int) -> bool:
    """Return whether a body has any velocity."""
    return bool(motion[i, 3] != 0.0 or motion[i, 4] != 0.0 or motion[i, 5] != 0.0)


@array_kernel
def mark(
    marks: Bools, pairs: Ints, walls: Ints, motion: Floats, outlines: Floats, boxes: Floats,
    first_box: int,
) -> None:  # fmt: skip
    """Mark all bodies that overlap another or an obstacle, and boxes that still move.

    Boxes at rest against each other or a wall wait until somebody touches one of them.
    """
    for i in range(first_box, marks.shape[0]):
        marks[i] = is_moving(motion, i)
    changed = True
    while changed:
        changed = False
        for k in range(pairs.shape[0]):
            i, j = pairs[k, 0], pairs[k, 1]
            if marks[i] and marks[j]:
                continue
            if min(i, j) >= first_box and not (marks[i] or marks[j]):
                continue
            if do_overlap(motion, outlines, i, j):
                changed = changed or max(i, j) >= first_box
                marks[i] = marks[j] = True
    for k in range(walls.shape[0]):
        i = walls[k, 0]
        if i < first_box and not marks[i]:
            marks[i] = does_meet(motion, outlines, i, boxes[walls[k, 1]])


@array_kernel
def list_overlaps(found: Ints, pairs: Ints, marks: Bools, motion: Floats, outlines: Floats) -> int:
    """Write those pairs of marked bodies that overlap; return how many there are."""
    count = 0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        if marks[i] and marks[j] and do_overlap(motion, outlines, i, j):
            found[count, 0], found[count, 1] = i, j
            count += 1
    return count
