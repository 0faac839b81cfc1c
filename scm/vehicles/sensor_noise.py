"""How a device spoils what it measures: bias that wanders, noise, limits, rounding.

The wandering is a random walk W over whole seconds, W(0) = 0 and Var W(t) = t, that is found for
any second at once, by halving a span of 2^20 s (12 days) about it:

    W(middle) = (W(left) + W(right)) / 2 + sqrt(right - left) / 2 * Z(middle)

with Z(second) a normal number of that second alone. So a bias does not depend on when it was read.
Source: Levy's construction of Brownian motion.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.noise import Keys, bases_of, normals
from scm.vehicles.sensor import Facts

LONGEST_S = 2**20
WALK = np.uint64(0xA5A3564E27F88691)


def spoil(facts: Facts, exact: Floats, bias: Floats, bases: Keys) -> Floats:
    """Return readings (k, n) of exact values; bias (k, n) or (n,); a base of noise for each row."""
    values = exact + bias if bias.any() else exact
    if any(facts.noise):
        values = values + np.array(facts.noise) * normals(bases, exact.shape[1])
    if min(facts.saturates_at) < math.inf:
        limit = np.array(facts.saturates_at)
        values = np.clip(values, -limit, limit)
    if facts.quantum:
        values = np.floor(values / facts.quantum) * facts.quantum
    if facts.seen is not None:
        nearest, farthest = facts.seen
        values = np.where((values >= nearest) & (values <= farthest), values, np.inf)
    for i in facts.angles:
        turns = np.ceil((values[:, i] - math.pi) / (2.0 * math.pi))
        values[:, i] -= 2.0 * math.pi * turns
    return values


def wander(keys: Keys, seconds: Ints, count: int) -> Floats:
    """Return how far `count` walks of each key are after whole seconds (k,), shape (k, count)."""
    keys = keys ^ WALK
    seconds = np.minimum(seconds, LONGEST_S)
    left, right = np.zeros_like(seconds), np.full_like(seconds, LONGEST_S)
    at_left = np.zeros((len(keys), count))
    at_right = math.sqrt(LONGEST_S) * normals(bases_of(keys, right), count)
    span = LONGEST_S
    while span > 1:
        span //= 2
        middle = left + span
        z = normals(bases_of(keys, middle), count)
        at_middle = 0.5 * (at_left + at_right) + math.sqrt(0.5 * span) * z
        is_right = seconds >= middle
        left, right = np.where(is_right, middle, left), np.where(is_right, right, middle)
        at_left = np.where(is_right[:, None], at_middle, at_left)
        at_right = np.where(is_right[:, None], at_right, at_middle)
    return np.where((seconds >= right)[:, None], at_right, at_left)
