"""Motion between two sweeps from how ranges change: range flow, coarse to fine.

Of a wall that stands, seen at range r in direction a by a scanner that moves by (x, y) and turns
by w between two sweeps, the range along one beam changes by r_t, and from beam to beam by r_a a
radian:

    (cos a + r_a sin a / r) x + (sin a - r_a cos a / r) y - r_a w + r_t = 0

Each beam gives one such line; a robust least-squares fit gives the motion and its covariance. The
first sweep is moved by what was found and compared again, from every fourth beam to every one: so
large motions are linear too. Beams whose neighbours lie on another surface, or that bend, weigh
less. Where beams look one after another, both sweeps must first be taken to their ends
(`seen_at_end`).

Along a corridor nothing is seen of x, and the covariance says so. Holds: a level scanner, both
sweeps with the same beams, little motion beside the range.
Source: Jaimez, Monroy, Gonzalez-Jimenez, "Planar odometry from a radial laser scanner: a range
flow-based approach", ICRA 2016. The order of levels is theirs; the weights are ours.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.errors import MessageError
from scm.geometry import Pose2
from scm.vehicles.jit import array_kernel, inlined
from vehicle_agent.autonomy.sweep import Sweep, Twist

LEVELS = (4, 2, 1)  # beams taken together
ROUNDS = 3  # of warping at each level
REWEIGHTED = 4
JUMP = 0.1  # of the range: neighbours farther apart than that lie on different surfaces
NOISE_M = 0.01  # least scatter of a range
MIN_BEAMS = 12
UNSEEN = 1e-4  # of the best seen direction's information: what is less does not move
STILL, NONE = np.zeros(3), Pose2(0.0, 0.0, 0.0)
NO_MOTION = 1e6  # variance of what cannot be seen


@dataclass(frozen=True, slots=True, eq=False)
class Flow:
    """How the scanner moved from one sweep to the next.

    Attributes:
        motion: Of the scanner, in its frame at the first sweep [m, m, rad].
        covariance: Of x, y and yaw, (3, 3) [m, m, rad]; 1e6 where nothing was seen.
        beams: How many were compared.
        residual_m: Root mean square of what the motion leaves of the ranges' changes.
    """

    motion: Pose2
    covariance: Floats
    beams: int
    residual_m: float


def range_flow(first: Sweep, second: Sweep, guess: Pose2 = NONE) -> Flow:
    """Return how the scanner moved between two sweeps.

    Args:
        first: Earlier sweep, as seen at its end.
        second: Later one, likewise, with the same beams.
        guess: Motion to begin from, as that between the two sweeps before.

    Raises:
        MessageError: when they do not have the same beams.
    """
    if len(first.ranges) != len(second.ranges) or first.bearings[0] != second.bearings[0]:
        msg = (
            f"range flow: expected two sweeps with the same beams, got {len(first.ranges)} from "
            f"{first.bearings[0]:g} rad and {len(second.ranges)} from {second.bearings[0]:g} rad"
        )
        raise MessageError(msg)
    moved, normal = np.array(guess), np.zeros((3, 3))
    beams, residual = 0, math.inf
    for merged in LEVELS:
        count = len(first.ranges) // merged
        beam = merged * first.step, float(first.bearings[0]) + 0.5 * (merged - 1) * first.step
        before, after = (_together(one.ranges[: count * merged], merged) for one in (first, second))
        at_once = np.zeros(count)
        for _ in range(ROUNDS):
            was = _at_end(before, at_once, *beam, first.is_whole, STILL, moved)
            lines, weights = _lines(was, after, *beam, first.is_whole)
            beams = len(lines)
            if beams < MIN_BEAMS:
                continue
            more, normal, residual = _solved(lines, weights)
            c, s = math.cos(moved[2]), math.sin(moved[2])
            x, y, turn = more
            moved = moved + np.array((c * x - s * y, s * x + c * y, turn))
    return Flow(Pose2(*map(float, moved)), _covariance(normal, beams), beams, residual)


def seen_at_end(sweep: Sweep, twist: Twist) -> Sweep:
    """Return a sweep as if all beams had looked when the last did.

    Args:
        sweep: With times of its beams.
        twist: Of the scanner during the sweep, in its frame.
    """
    motion = np.array((twist.along_mps, twist.across_mps, twist.yaw_rate_radps))
    if not sweep.ago_s.any() or not motion.any():
        return replace(sweep, ago_s=np.zeros(len(sweep.ago_s)))
    beam = sweep.step, float(sweep.bearings[0])
    ranges = _at_end(sweep.ranges, sweep.ago_s, *beam, sweep.is_whole, motion, STILL)
    return replace(sweep, ranges=ranges, ago_s=np.zeros(len(sweep.ago_s)))


def _covariance(normal: Floats, beams: int) -> Floats:
    """Return the inverse of a normal matrix; directions that it does not hold are unknown."""
    if beams < MIN_BEAMS:
        return NO_MOTION * np.eye(3)
    values, axes = np.linalg.eigh(normal)
    variances = 1.0 / np.maximum(values, 1.0 / NO_MOTION)
    return np.asarray((axes * variances) @ axes.T)


def _together(ranges: Floats, merged: int) -> Floats:
    """Return means over so many beams, of those that lie on the nearest surface."""
    if merged == 1:
        return ranges
    groups = ranges.reshape(-1, merged)
    nearest = groups.min(axis=1, keepdims=True)
    on_it = groups < nearest * (1.0 + JUMP)
    with np.errstate(invalid="ignore"):
        means = np.where(on_it, groups, 0.0).sum(axis=1) / np.maximum(on_it.sum(axis=1), 1)
    return np.where(np.isfinite(nearest[:, 0]), means, np.inf)


@array_kernel
def _at_end(
    ranges: Floats,
    ago_s: Floats,
    step: float,
    start: float,
    whole: bool,
    twist: Floats,
    moved: Floats,
) -> Floats:
    """Return a sweep as seen at once, at its end, by a scanner that moved on; inf where nothing is.

    Args:
        ranges: (n,).
        ago_s: How long before the end each was seen, (n,).
        step: From beam to beam [rad].
        start: Where the first looks [rad].
        whole: Whether the beams go round the circle.
        twist: Of the scanner, in its frame, (3,).
        moved: How it moved on from the end of this sweep, (3,).
    """
    count = len(ranges)
    seen = np.full(count, np.inf)
    angles, far = np.full(count, np.nan), np.empty(count)
    c, s = math.cos(moved[2]), math.sin(moved[2])
    for i in range(count):
        if not math.isfinite(ranges[i]):
            continue
        a, back = start + i * step, -ago_s[i]
        half = 0.5 * back * twist[2]
        x = back * (math.cos(half) * twist[0] - math.sin(half) * twist[1]) - moved[0]
        y = back * (math.sin(half) * twist[0] + math.cos(half) * twist[1]) - moved[1]
        x += ranges[i] * math.cos(a + 2.0 * half)
        y += ranges[i] * math.sin(a + 2.0 * half)
        x, y = c * x + s * y, c * y - s * x
        far[i] = math.hypot(x, y)
        turn = math.atan2(y, x) - a
        turn -= 2.0 * math.pi * np.round(turn / (2.0 * math.pi))
        angles[i] = i + turn / step
    for i in range(count if whole else count - 1):
        j = (i + 1) % count
        if math.isnan(angles[i]) or math.isnan(angles[j]):
            continue
        first, last = angles[i], angles[j] + (count if j == 0 else 0)
        if last <= first or abs(ranges[i] - ranges[j]) > JUMP * min(ranges[i], ranges[j]):
            continue
        for k in range(math.ceil(first), math.floor(last) + 1):
            at = k % count if whole else k
            if 0 <= at < count:
                part = (k - first) / (last - first)
                seen[at] = min(seen[at], far[i] + part * (far[j] - far[i]))
    return seen


@inlined
def _slope(r: Floats, i: int, step: float, whole: bool) -> tuple[float, float]:
    """Return dr/da at a beam, from the nearer side more, and how much it bends; NaN at an edge."""
    count = len(r)
    if not whole and (i == 0 or i == count - 1):
        return math.nan, 0.0
    left, mid, right = r[i - 1], r[i], r[(i + 1) % count]
    limit = JUMP * mid
    if not (abs(left - mid) < limit and abs(right - mid) < limit):  # false for inf and NaN too
        return math.nan, 0.0
    width = mid * step
    to_left, to_right = math.hypot(width, mid - left), math.hypot(width, right - mid)
    slope = (to_right * (mid - left) + to_left * (right - mid)) / (to_left + to_right) / step
    return slope, abs(left - 2.0 * mid + right)


@array_kernel
def _lines(
    before: Floats, after: Floats, step: float, start: float, whole: bool
) -> tuple[Floats, Floats]:
    """Return a line for each beam that both sweeps see, x, y, w and r_t (n, 4), weights (n,)."""
    lines, weights = np.empty((len(before), 4)), np.empty(len(before))
    found = 0
    for i in range(len(before)):
        first, bend = _slope(before, i, step, whole)
        second, bend_after = _slope(after, i, step, whole)
        r, a, r_a = 0.5 * (before[i] + after[i]), start + i * step, 0.5 * (first + second)
        if not (math.isfinite(r) and math.isfinite(r_a)):
            continue
        lines[found, 0] = math.cos(a) + r_a * math.sin(a) / r
        lines[found, 1] = math.sin(a) - r_a * math.cos(a) / r
        lines[found, 2] = -r_a
        lines[found, 3] = after[i] - before[i]
        weights[found] = 1.0 / (NOISE_M**2 + (0.5 * (bend + bend_after)) ** 2)
        found += 1
    return lines[:found], weights[:found]


@inlined
def _square(lines: Floats, weights: Floats, k: int, move: Floats) -> float:
    """Return what a motion leaves of one line, squared and weighed."""
    left = lines[k, 0] * move[0] + lines[k, 1] * move[1] + lines[k, 2] * move[2] + lines[k, 3]
    return float(weights[k] * left * left)


@array_kernel
def _solved(lines: Floats, weights: Floats) -> tuple[Floats, Floats, float]:
    """Return the motion that explains the lines, J' W J over its variance, and the residual."""
    count = len(lines)
    move, normal, squares = np.zeros(3), np.zeros((3, 3)), np.empty(count)
    spread = math.inf
    for _ in range(REWEIGHTED):
        sums = np.zeros((3, 4))
        for k in range(count):
            w = weights[k] / (1.0 + _square(lines, weights, k, move) / (2.0 * spread))
            for p in range(3):
                for q in range(4):
                    sums[p, q] += w * lines[k, p] * lines[k, q]
        normal = sums[:, :3].copy()
        values, axes = np.linalg.eigh(normal)
        move = np.zeros(3)
        for p in range(3):
            if values[p] > UNSEEN * values[2]:
                move -= axes[:, p] * ((axes[:, p] * sums[:, 3]).sum() / values[p])
        for k in range(count):
            squares[k] = _square(lines, weights, k, move)
        spread = max(2.2 * np.median(squares), 1e-6)
    residual = np.sqrt((np.minimum(squares, 9.0 * spread) / weights).mean())
    return move, normal / max(spread, 1.0), residual
