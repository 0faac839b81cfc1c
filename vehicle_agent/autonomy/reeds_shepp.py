"""Shortest paths of a car that drives forward and backward and turns no tighter than a radius.

A shortest path is one of 48 words of arcs C at full steering and straight lines S:

    CSC   CCC   CCCC with equal middle arcs   CC(pi/2)SC and its reverse   CC(pi/2)SC(pi/2)C

Eight families of three lengths t, u and v are solved in closed form, for a start at the origin and
a radius of 1. All else follows by symmetry: forward and backward exchanged, left and right
exchanged, the word driven from the goal to the start. In each family a chain of tangent circles
joins the middles of the first and the last one; `_solved` inverts that chain.
Frame: the start's, x ahead and y left. Lengths: + forward, - backward.
Source: Reeds and Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific
Journal of Mathematics 145(2), 1990, section 8.
"""

import math
from collections.abc import Sequence

import numpy as np

from scm.arrays import Floats
from scm.geometry import TAU, Pose2
from scm.vehicles.jit import array_kernel, inlined, kernel_function
from vehicle_agent.autonomy.plan import Path

FAMILIES = 8
VIEWS = 8  # of the goal: three symmetries, each used or not
WORDS = VIEWS * FAMILIES  # as numbers; those of palindromes, seen from the goal, are left out
LONGEST_WORD = 5
ROUNDING = 1e-13  # by which an angle or a length may have the wrong sign
QUARTER = 0.5 * math.pi
SPACING_M = 0.02

_SIDES = np.array([
    [1, 0, 1, 0, 0], [1, -1, 1, 0, 0], [1, -1, 0, 1, 0], [1, 0, -1, 0, 0],
    [1, -1, 1, -1, 0], [1, -1, 1, -1, 0], [1, -1, 0, -1, 0], [1, -1, 0, 1, -1],
])  # fmt: skip
"""Of each family's segments: +1 left, -1 right, 0 straight."""
_COUNTS = np.array([3, 3, 4, 3, 4, 4, 4, 5])
_SAME_SIDE = 3  # families before this number end on the side on which they begin
_U_SIGN = np.array([1, -1, -1, 1, 1, -1, -1, -1])
_V_SIGN = np.array([1, 0, -1, 1, -1, 1, -1, 1])  # 0: either
_FROM_GOAL = np.array([False, True, True, False, False, False, True, False])
_CUSPS = np.array([0, 1, 1, 0, 1, 2, 1, 2])  # of L+ R- L+: one more
_FOUR_ARCS = np.array([False, False, False, False, True, True, False, False])
_EXTRA = np.array([0.0, 0.0, QUARTER, 0.0, 0.0, 0.0, QUARTER, 2.0 * QUARTER])  # of quarter arcs


@inlined
def _wrapped(angle: float) -> float:
    return angle - TAU * math.floor((angle + math.pi) / TAU)


@kernel_function
def _solved(family: int, far: float, angle: float, yaw: float) -> tuple[float, float, float]:
    """Return t, u and v of a family's word, NaN where there is none.

    The last circle's middle is `far` from the first one's, in direction `angle`.
    """
    side = math.sqrt(far * far - 4.0)  # NaN of what is negative, as of acos beyond 1: no word
    if family == 0:  # L+ S+ L+
        t, u = angle, far
        v = yaw - t
    elif family == 1:  # L+ R- L
        u = -2.0 * math.asin(0.25 * far)
        t = angle + 0.5 * u + math.pi
        v = yaw - t + u
    elif family == 2:  # L+ R-(pi/2) S- L-
        t, u = angle + math.atan2(side, -2.0), 2.0 - side
        v = yaw - t - QUARTER
    elif family == 3:  # L+ S+ R+
        t, u = angle + math.atan2(2.0, side), side
        v = t - yaw
    elif family == 4:  # L+ R+ L- R-
        u = math.acos(0.25 * (2.0 + far))
        t = angle + u + QUARTER
        v = t - 2.0 * u - yaw
    elif family == 5:  # L+ R- L- R+
        u = -math.acos(max(20.0 - far * far, -1.0) / 16.0)
        t = angle + QUARTER - math.atan2(math.sin(u), 2.0 - math.cos(u))
        v = t - yaw
        t = t if u >= -QUARTER else math.nan
    elif family == 6:  # L+ R-(pi/2) S- R-
        t, u = angle + QUARTER, 2.0 - far
        v = t + QUARTER - yaw
    else:  # L+ R-(pi/2) S- L-(pi/2) R+
        t, u = angle + math.atan2(side, -2.0), 4.0 - side
        v = t - yaw
    t, v = _wrapped(t), _wrapped(v)
    exists = (
        t >= -ROUNDING and u * _U_SIGN[family] >= -ROUNDING and v * _V_SIGN[family] >= -ROUNDING
    )
    return (t, u, v) if exists else (math.nan, math.nan, math.nan)


@inlined
def _view(number: int, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Return a goal as a symmetry shows it.

    The number is a sum of 1: forward and backward exchanged, 2: left and right, 4: start and goal.
    """
    if number & 4:
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = x * c + y * s, x * s - y * c
    if number & 1:
        x, yaw = -x, -yaw
    if number & 2:
        y, yaw = -y, -yaw
    return x, y, yaw


@inlined
def _between(side: int, x: float, y: float, yaw: float) -> tuple[float, float]:
    """Return distance and direction from the first circle, a left one, to the last, on a side."""
    right, up = x - side * math.sin(yaw), y - 1.0 + side * math.cos(yaw)
    return math.hypot(right, up), math.atan2(up, right)


@kernel_function
def least_cost(x: float, y: float, yaw: float, radius: float, reverse: float, cusp: float) -> float:
    """Return the least cost of a word to a goal given in the start's frame, as a length.

    Each length driven backward costs the share `reverse` on top, each change of gear `cusp`.
    """
    least = math.inf
    cusp /= radius
    for view in range(VIEWS):
        seen_x, seen_y, seen_yaw = _view(view, x / radius, y / radius, yaw)
        far, angle = _between(1, seen_x, seen_y, seen_yaw)
        for family in range(FAMILIES):
            if family == _SAME_SIDE:
                far, angle = _between(-1, seen_x, seen_y, seen_yaw)
            if view < 4 or _FROM_GOAL[family]:
                t, u, v = _solved(family, far, angle, seen_yaw)
                middle = 2.0 if _FOUR_ARCS[family] else 1.0
                total = abs(t) + middle * abs(u) + abs(v) + _EXTRA[family]
                ahead = t + max(u, 0.0) + max(v, 0.0)
                cusps = _CUSPS[family] + (1 if family == 1 and v > 0.0 else 0)
                total += reverse * (ahead if view & 1 else total - ahead) + cusp * cusps
                least = total if total < least else least  # noqa: FURB136  NaN is no word
    return least * radius


@kernel_function
def length(x: float, y: float, yaw: float, radius: float) -> float:
    """Return the length of the shortest path to a goal given in the start's frame."""
    return least_cost(x, y, yaw, radius, 0.0, 0.0)


@kernel_function
def word(number: int, x: float, y: float, yaw: float, lengths: Floats, sides: Floats) -> int:
    """Write one word's segments, and return how many they are; 0: no such word leads there.

    Args:
        number: Of the word, below `WORDS`.
        x: Of the goal in the start's frame, divided by the radius.
        y: Likewise.
        yaw: Of the goal in the start's frame.
        lengths: (5,), written: signed lengths, divided by the radius.
        sides: (5,), written: +1 left, -1 right, 0 straight.
    """
    view, family = number // FAMILIES, number % FAMILIES
    if view >= 4 and not _FROM_GOAL[family]:
        return 0
    x, y, yaw = _view(view, x, y, yaw)
    far, angle = _between(1 if family < _SAME_SIDE else -1, x, y, yaw)
    t, u, v = _solved(family, far, angle, yaw)
    if math.isnan(t):
        return 0
    count = _COUNTS[family]
    gear = -1.0 if view & 1 else 1.0
    hand = -1.0 if view & 2 else 1.0
    for i in range(count):
        at = count - 1 - i if view & 4 else i
        if i == 0 or i == count - 1:
            one = t if i == 0 else v
        elif _FOUR_ARCS[family]:
            one = -u if family == 4 and i == 2 else u
        else:
            one = u if _SIDES[family, i] == 0 or count == 3 else -QUARTER
        lengths[at], sides[at] = gear * one, hand * _SIDES[family, i]
    return int(count)


@array_kernel
def _lengths(goals: Floats, radius: float) -> Floats:
    found = np.empty(len(goals))
    for k in range(len(goals)):
        found[k] = length(goals[k, 0], goals[k, 1], goals[k, 2], radius)
    return found


def lengths_m(goals: Floats, radius_m: float) -> Floats:
    """Return the lengths of the shortest paths to goals (n, 3) in the start's frame, (n,) [m]."""
    return _lengths(np.asarray(goals, dtype=np.float64), radius_m)


@array_kernel
def _shortest(x: float, y: float, yaw: float) -> Floats:
    best, total = np.empty((0, 2)), math.inf
    sizes, sides = np.empty(LONGEST_WORD), np.empty(LONGEST_WORD)
    for number in range(WORDS):
        count = word(number, x, y, yaw, sizes, sides)
        if count > 0 and np.abs(sizes[:count]).sum() < total:
            total = np.abs(sizes[:count]).sum()
            best = np.stack((sizes[:count], sides[:count]), axis=1)
    return best


def shortest_segments(start: Pose2, goal: Pose2, radius_m: float) -> Floats:
    """Return the shortest path's segments: signed lengths [m] and curvatures [1/m], (n, 2)."""
    ahead = start.inverse() @ goal
    best = _shortest(ahead.x / radius_m, ahead.y / radius_m, ahead.yaw)
    return best * (radius_m, 1.0 / radius_m)


def sampled(start: Pose2, segments: Floats, spacing_m: float = SPACING_M) -> Path:
    """Return the path along segments of constant curvature, from a start.

    Args:
        start: In the map's frame.
        segments: (n, 2) signed lengths [m] and curvatures [1/m].
        spacing_m: Greatest distance from pose to pose; the end of each segment is one.
    """
    poses: list[Sequence[float]] = [start]
    gears, curvatures = [1.0], [0.0]
    for size, curvature in segments:
        if abs(size) <= ROUNDING:
            continue
        steps = math.ceil(abs(size) / spacing_m - 1e-9)
        begin = Pose2(*poses[-1])
        for k in range(1, steps + 1):
            along = k / steps * float(size)
            half = 0.5 * along * float(curvature)
            chord = along * (math.sin(half) / half if half else 1.0)
            step = Pose2(chord * math.cos(half), chord * math.sin(half), 2.0 * half)
            poses.append(begin @ step)
        gears += steps * [math.copysign(1.0, size)]
        curvatures += steps * [float(curvature)]
    if len(gears) > 1:
        gears[0], curvatures[0] = gears[1], curvatures[1]
    return Path(np.array(poses), np.array(gears), np.array(curvatures))
