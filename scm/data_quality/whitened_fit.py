"""Least squares under white noise on top of a random walk, with standard errors that hold.

Dead reckoning against a pose leaves just that: the pose's own noise, and drift that adds up. The
steady Kalman filter of such a series is one recursion, e = dy + theta * e_before, for every column
alike; how much of either there is comes from the rows themselves. Standard errors are the larger
of the classical ones and those of sums over blocks, which forgive what is left of correlation.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scm.arrays import Floats
from scm.data_quality.quality import Measured
from scm.vehicles.jit import array_kernel

THETAS = (0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.9, 0.94, 0.965, 0.98, 0.99, 0.995)
BLOCKS = 40
HUBER = 3.0
ROUNDS = 3
SHORTEST = 5
TINY = 1e-300  # what is left of a recording without any noise
FREE = 100.0  # what no number of ours comes near; keeps the std of what nothing shows finite


@dataclass(frozen=True, slots=True)
class Fit:
    """What was fitted.

    Attributes:
        values, std: Of each column, shape `(k,)`.
        leak: Square root of each factor's variance inflation, shape `(k,)`: how alike its column
            is to what the others make up together.
        theta: Share of the noise that does not add up.
    """

    values: Floats
    std: Floats
    leak: Floats
    theta: float

    def numbers(self, names: Iterable[str]) -> dict[str, Measured]:
        """Return the first columns' values by name."""
        columns = zip(names, self.values, self.std, self.leak, strict=False)
        return {n: Measured(float(v), float(std), float(leak)) for n, v, std, leak in columns}


def fit(
    measured: Floats,
    columns: Floats,
    priors: Floats | None = None,
    starts: Sequence[int] = (0,),
    near: Fit | None = None,
) -> Fit:
    """Fit `measured` as columns plus a constant for each axis and each unbroken stretch.

    Args:
        measured: Shape `(n, axes)`.
        columns: Shape `(n, axes, k)`.
        priors: Standard deviation around zero that each column's factor is allowed, shape `(k,)`;
            infinite, or None for all, where it is free.
        starts: First row of each stretch, the first one 0; nothing is said about the steps between.
        near: A fit of nearly the same columns, to save looking for its noise again.
    """
    n, axes, k = columns.shape
    allowed = np.full(k, FREE) if priors is None else np.minimum(priors, FREE)
    parts = [slice(i, j) for i, j in pairwise((*starts, n)) if j - i >= SHORTEST]
    theta, weights = 0.6 if near is None else near.theta, np.ones((n, axes))
    values, rows, e = _solve(measured, columns, theta, weights, allowed, parts)
    for _ in range(ROUNDS if near is None else 1):
        theta = _likeliest(measured - columns @ values, parts)
        weights = _weights(e)
        values, rows, e = _solve(measured, columns, theta, weights, allowed, parts)
    std, leak = _errors(rows, e, weights, allowed)
    return Fit(values, std, leak, theta)


def whiten(values: Floats, theta: float, parts: Sequence[slice]) -> Floats:
    """Return the one-step errors of the steady filter along axis 0, each part's level unknown.

    Rows of no part become zero.
    """
    n = len(values)
    flat = np.ascontiguousarray(values, dtype=np.float64).reshape(n, -1)
    result = np.zeros_like(flat)
    for part in parts:
        _filter(flat[part], theta, result[part])
    return result.reshape(values.shape)


@array_kernel
def _filter(values: Floats, theta: float, e: Floats) -> None:
    """Write one part's errors less those that its likeliest level leaves, (n, columns)."""
    n, columns = values.shape
    level, total, share = np.zeros(columns), 0.0, 1.0  # share of the level in a row's error
    for i in range(n):
        for j in range(columns):
            e[i, j] = values[i, j]
            if i > 0:
                e[i, j] += theta * e[i - 1, j] - values[i - 1, j]
            level[j] += share * e[i, j]
        total += share * share
        share = share * theta if share > TINY else 0.0
    share = 1.0
    for i in range(n):
        if share < TINY:
            break
        for j in range(columns):
            e[i, j] -= share * level[j] / total
        share *= theta


def _solve(
    measured: Floats,
    columns: Floats,
    theta: float,
    weights: Floats,
    allowed: Floats,
    parts: Sequence[slice],
) -> tuple[Floats, Floats, Floats]:
    """Return factors, whitened columns `(n, axes, k)` and whitened residual `(n, axes)`."""
    rows, y = whiten(columns, theta, parts), whiten(measured, theta, parts)
    unit, scale = _unit(rows)
    weighted = unit * weights.reshape(-1, 1)
    normal, right = weighted.T @ unit, weighted.T @ y.ravel()
    free = np.linalg.lstsq(normal, right, rcond=1e-12)[0] / scale
    noise = _spread(y - rows @ free)
    normal = normal + np.diag((noise / (allowed * scale)) ** 2)
    values = np.linalg.lstsq(normal, right, rcond=1e-15)[0] / scale
    return values, rows, y - rows @ values


def _unit(rows: Floats) -> tuple[Floats, Floats]:
    """Return columns of length 1, all axes below each other, `(n * axes, k)`, and their lengths."""
    flat = rows.reshape(-1, rows.shape[2])
    scale = np.sqrt((flat * flat).sum(axis=0)) + 1e-12
    return flat / scale, scale


def _spread(e: Floats) -> float:
    """Return the standard deviation, from the median so that outliers do not count."""
    return float(1.4826 * np.median(np.abs(e))) + 1e-12


def _weights(e: Floats) -> Floats:
    bound = HUBER * np.array([_spread(e[:, i]) for i in range(e.shape[1])])
    return np.minimum(1.0, bound / np.maximum(np.abs(e), 1e-12))


def _likeliest(residual: Floats, parts: Sequence[slice]) -> float:
    """Return the theta under which the residual is most likely."""
    costs = []
    for theta in THETAS:
        e = whiten(residual, theta, parts)
        costs.append(np.log(np.minimum(e**2, (4.0 * _spread(e)) ** 2).mean() + TINY))
    return THETAS[int(np.argmin(costs))]


def _errors(rows: Floats, e: Floats, weights: Floats, allowed: Floats) -> tuple[Floats, Floats]:
    """Return standard errors and leaks, shape `(k,)` each."""
    n, _, k = rows.shape
    unit, scale = _unit(rows)
    variance = float(np.mean(weights * e**2))
    normal = (unit * weights.reshape(-1, 1)).T @ unit
    normal = normal + np.diag(variance / (allowed * scale) ** 2)
    inverse = np.linalg.pinv(normal, rcond=1e-15, hermitian=True)
    scores = (unit * (weights * e).reshape(-1, 1)).reshape(rows.shape).sum(axis=1)
    edges = np.linspace(0, n, min(BLOCKS, n) + 1).astype(int)[:-1]
    sums = np.add.reduceat(scores, edges, axis=0)
    spread = inverse @ (sums.T @ sums) @ inverse * (len(sums) / max(1, len(sums) - k))
    classical = np.diag(inverse) * variance
    std: Floats = np.sqrt(np.maximum(classical, np.diag(spread))) / scale
    leak: Floats = np.sqrt(np.maximum(1.0, np.diag(inverse) * np.diag(normal)))
    return std, leak
