"""How much of a move bodies can make before they would pass through each other or through a wall.

A contact step sees bodies only where a move has brought them. pymunk parts two that overlap along
the shortest way, which is the wrong way once one is past the middle of the other, and it sees
nothing of what a body jumped over. So a move is followed in samples, and two bodies, or a body and
an obstacle, stop at the last sample at which they overlap by no more than

    max(MAX_OVERLAP * smallest half side of the bodies, overlap at the start)

A sample is at most half of that limit away from the next: where they stop they do overlap, and the
solver finds the contact. All bodies move at the same time; one that stops may stop others. Those
that nobody can move never stop.
Source: conservative advancement (Mirtich, Impulse-based dynamic simulation, 1996), with samples.
"""

import math

from scm.arrays import Bools, Floats, Ints
from scm.vehicles.jit import array_kernel, kernel_function

MAX_OVERLAP = 0.25  # of the smallest half side; pymunk parts bodies the wrong way from 1 on
DEEP = 2.0  # times that; who overlaps so far was put there, and goes out as the solver says
MAX_PASSES = 20  # later a body that has to stop earlier still does not move at all
ROUNDING_M = 1e-9


@kernel_function
def overlap_of(
    x: float, y: float, c: float, s: float, length: float, width: float,
    other_length: float, other_width: float,
) -> float:  # fmt: skip
    """Return the overlap of a box at (x, y), turned by (c, s), and an upright one at 0 [m].

    It is the shortest way out along any side's normal; below 0 the boxes are apart.
    """
    turn_c, turn_s = abs(c), abs(s)
    return min(
        other_length + turn_c * length + turn_s * width - abs(x),
        other_width + turn_s * length + turn_c * width - abs(y),
        length + turn_c * other_length + turn_s * other_width - abs(c * x + s * y),
        width + turn_s * other_length + turn_c * other_width - abs(c * y - s * x),
    )


@kernel_function
def pair_overlap(
    starts: Floats, moves: Floats, outlines: Floats, i: int, j: int, at_i: float, at_j: float
) -> float:
    """Return the overlap of two bodies, each after a share of its move [m]."""
    yaw_i, yaw_j = starts[i, 2] + at_i * moves[i, 2], starts[j, 2] + at_j * moves[j, 2]
    ci, si, cj, sj = math.cos(yaw_i), math.sin(yaw_i), math.cos(yaw_j), math.sin(yaw_j)
    dx = starts[j, 0] + at_j * moves[j, 0] - starts[i, 0] - at_i * moves[i, 0]
    dy = starts[j, 1] + at_j * moves[j, 1] - starts[i, 1] - at_i * moves[i, 1]
    c, s = ci * cj + si * sj, ci * sj - si * cj
    x = ci * dx + si * dy + c * outlines[j, 0] - s * outlines[j, 1] - outlines[i, 0]
    y = ci * dy - si * dx + s * outlines[j, 0] + c * outlines[j, 1] - outlines[i, 1]
    return overlap_of(x, y, c, s, outlines[j, 2], outlines[j, 3], outlines[i, 2], outlines[i, 3])


@kernel_function
def wall_overlap(
    starts: Floats, moves: Floats, outlines: Floats, i: int, at: float, box: Floats
) -> float:
    """Return the overlap of a body, after a share of its move, and an obstacle [m]."""
    yaw = starts[i, 2] + at * moves[i, 2]
    ci, si = math.cos(yaw), math.sin(yaw)
    dx = starts[i, 0] + at * moves[i, 0] + ci * outlines[i, 0] - si * outlines[i, 1] - box[0]
    dy = starts[i, 1] + at * moves[i, 1] + si * outlines[i, 0] + ci * outlines[i, 1] - box[1]
    c, s = box[2] * ci + box[3] * si, box[2] * si - box[3] * ci
    x, y = box[2] * dx + box[3] * dy, box[2] * dy - box[3] * dx
    return overlap_of(x, y, c, s, outlines[i, 2], outlines[i, 3], box[4], box[5])


@kernel_function
def length_of(moves: Floats, outlines: Floats, i: int) -> float:
    """Return the longest way that any point of a body goes in its move [m]."""
    way = math.sqrt(moves[i, 0] * moves[i, 0] + moves[i, 1] * moves[i, 1])
    return float(way + abs(moves[i, 2]) * outlines[i, 4])


@array_kernel
def is_any_fast(moves: Floats, outlines: Floats) -> bool:
    """Return whether any two of the bodies might pass through each other in one move."""
    longest, narrowest = 0.0, math.inf
    for i in range(moves.shape[0]):
        longest = max(longest, length_of(moves, outlines, i))
        narrowest = min(narrowest, outlines[i, 2], outlines[i, 3])
    return bool(2.0 * longest > MAX_OVERLAP * narrowest)


@kernel_function
def goes_on(shares: Floats, outlines: Floats, i: int, at: float) -> bool:
    """Return whether a body that can be stopped makes more of its move than a share."""
    return bool(outlines[i, 5] != 0.0 and shares[i] > at)


@kernel_function
def stop(shares: Floats, outlines: Floats, i: int, at: float) -> bool:
    """Limit a body's move to a share; return whether that is less than before."""
    if not goes_on(shares, outlines, i, at):
        return False
    shares[i] = at
    return True


@kernel_function
def stop_pair(
    shares: Floats, starts: Floats, moves: Floats, outlines: Floats, i: int, j: int, late: bool
) -> bool:
    """Stop two bodies before they overlap too far; return whether anything changed."""
    limit = MAX_OVERLAP * min(outlines[i, 2], outlines[i, 3], outlines[j, 2], outlines[j, 3])
    way = length_of(moves, outlines, i) + length_of(moves, outlines, j)
    samples = max(1, math.ceil(2.0 * way / limit))
    allowed = max(limit, pair_overlap(starts, moves, outlines, i, j, 0.0, 0.0)) + ROUNDING_M
    if allowed > DEEP * limit:
        return False
    for k in range(1, samples + 1):
        at_i, at_j = min(k / samples, shares[i]), min(k / samples, shares[j])
        if pair_overlap(starts, moves, outlines, i, j, at_i, at_j) > allowed:
            last = (k - 1) / samples
            # The passes may go on for others alone: then nothing changes here.
            if late and (goes_on(shares, outlines, i, last) or goes_on(shares, outlines, j, last)):
                last = 0.0
            first = stop(shares, outlines, i, last)
            return stop(shares, outlines, j, last) or first
    return False


@kernel_function
def stop_at_wall(
    shares: Floats, starts: Floats, moves: Floats, outlines: Floats, i: int, box: Floats
) -> bool:
    """Stop a body before it overlaps an obstacle too far; return whether anything changed."""
    limit = MAX_OVERLAP * min(outlines[i, 2], outlines[i, 3])
    samples = max(1, math.ceil(2.0 * length_of(moves, outlines, i) / limit))
    allowed = max(limit, wall_overlap(starts, moves, outlines, i, 0.0, box)) + ROUNDING_M
    if allowed > DEEP * limit:
        return False
    for k in range(1, samples + 1):
        at = min(k / samples, shares[i])
        if wall_overlap(starts, moves, outlines, i, at, box) > allowed:
            return stop(shares, outlines, i, (k - 1) / samples)
    return False


@array_kernel
def share_moves(
    shares: Floats, pairs: Ints, walls: Ints, starts: Floats, moves: Floats, outlines: Floats,
    boxes: Floats, marks: Bools, fast: bool,
) -> None:  # fmt: skip
    """Lower each body's share of its move to what it can make.

    Args:
        shares: (n,) 1 where a body can make all of its move.
        pairs: (k, 2) bodies near each other.
        walls: (l, 2) bodies and the obstacles near them.
        starts: (n, 3) x, y, yaw of the centres of gravity before the move.
        moves: (n, 3) what is to be added to them.
        outlines: (n, 6) as in `BroadPhase.touching`; then 1, or 0 where nothing moves the body.
        boxes: (m, 6) obstacles without the round ends of walls.
        marks: (n,) whether a body overlaps something after the move.
        fast: Whether bodies may have passed through something, and overlap nothing now.
    """
    passes, changed = 0, True
    while changed:
        passes, changed = passes + 1, False
        for k in range(walls.shape[0]):
            i = walls[k, 0]
            narrow = min(outlines[i, 2], outlines[i, 3])
            if marks[i] or (fast and length_of(moves, outlines, i) > MAX_OVERLAP * narrow):
                box = boxes[walls[k, 1]]
                changed = stop_at_wall(shares, starts, moves, outlines, i, box) or changed
        for k in range(pairs.shape[0]):
            i, j = pairs[k, 0], pairs[k, 1]
            meets = marks[i] and marks[j]
            if fast and not meets:
                narrow = min(outlines[i, 2], outlines[i, 3], outlines[j, 2], outlines[j, 3])
                way = length_of(moves, outlines, i) + length_of(moves, outlines, j)
                meets = way > MAX_OVERLAP * narrow
            if meets:
                late = passes > MAX_PASSES
                changed = stop_pair(shares, starts, moves, outlines, i, j, late) or changed
