"""Errors of a device: drifting bias, noise, saturation, quantisation.

The drift is a random walk W over whole seconds, W(0) = 0 and Var W(t) = t, that can be evaluated at
any second directly, by halving a span of 2^20 s (12 days) around it:

    W(middle) = (W(left) + W(right)) / 2 + sqrt(right - left) / 2 * Z(middle)

with Z(second) a normal number of that second. So a bias does not depend on when it was read.
Source: Levy's construction of Brownian motion.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.noise import Keys, bases_of, normals
from scm.vehicles.sensor import Device

MAX_WALK_S = 2**20
WALK = np.uint64(0xA5A3564E27F88691)


def add_device_errors(device: Device, exact: Floats, bias: Floats, bases: Keys) -> Floats:
    """Return readings (k, n) from exact values; bias (k, n) or (n,); a noise base for each row."""
    values = exact + bias if bias.any() else exact
    if any(device.noise):
        values = values + np.array(device.noise) * normals(bases, exact.shape[1])
    if min(device.saturates_at) < math.inf:
        limit = np.array(device.saturates_at)
        values = np.clip(values, -limit, limit)
    if device.quantum:
        values = np.floor(values / device.quantum) * device.quantum
    if device.seen is not None:
        nearest, farthest = device.seen
        values = np.where((values >= nearest) & (values <= farthest), values, np.inf)
    for i in device.angles:
        turns = np.ceil((values[:, i] - math.pi) / (2.0 * math.pi))
        values[:, i] -= 2.0 * math.pi * turns
    return values


def wander(keys: Keys, seconds: Ints, count: int) -> Floats:
    """Return `count` random walks of each key after whole seconds (k,), shape (k, count)."""
    keys = keys ^ WALK
    seconds = np.minimum(seconds, MAX_WALK_S)
    left, right = np.zeros_like(seconds), np.full_like(seconds, MAX_WALK_S)
    at_left = np.zeros((len(keys), count))
    at_right = math.sqrt(MAX_WALK_S) * normals(bases_of(keys, right), count)
    span = MAX_WALK_S
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
