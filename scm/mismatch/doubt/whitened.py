"""Least squares under white noise on top of a random walk, with standard errors that hold.

Dead reckoning against a pose leaves just that: the pose's own noise, and drift that adds up. The
steady Kalman filter of such a series is one recursion, e = dy + theta * e_before, for every column
alike; how much of either there is comes from the rows themselves. Standard errors are the larger
of the classical ones and those of sums over blocks, which forgive what is left of correlation.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats

THETAS = (0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.9, 0.94, 0.965, 0.98, 0.99, 0.995)
BLOCKS = 40
HUBER = 3.0
ROUNDS = 3
FREE = 100.0  # what no number of ours comes near; keeps the std of what nothing shows finite


@dataclass(frozen=True, slots=True)
class Fit:
    """What was fitted.

    Attributes:
        values, std: Of each column, shape `(k,)`.
        covariance: Shape `(k, k)`.
        noise: Standard deviation of the whitened residual.
        theta: Share of the noise that does not add up.
        residual: Before whitening, shape `(n, axes)`.
    """

    values: Floats
    std: Floats
    covariance: Floats
    noise: float
    theta: float
    residual: Floats


def fit(measured: Floats, columns: Floats, priors: Floats | None = None) -> Fit:
    """Fit `measured` as a constant an axis plus columns.

    Args:
        measured: Shape `(n, axes)`.
        columns: Shape `(n, axes, k)`.
        priors: Standard deviation around zero that each column's factor is allowed, shape `(k,)`;
            infinite, or None for all, where it is free.
    """
    n, axes, k = columns.shape
    free = np.full(k, FREE) if priors is None else np.minimum(priors, FREE)
    allowed = np.concatenate((free, np.full(axes, np.inf)))
    constant = np.broadcast_to(np.eye(axes), (n, axes, axes))
    full = np.concatenate((columns, constant), axis=2)
    theta, weights = 0.6, np.ones((n, axes))
    values, rows, e = _solve(measured, full, theta, weights, allowed)
    for _ in range(ROUNDS):
        residual = measured - full @ values
        theta = _likeliest(residual)
        weights = _weights(e)
        values, rows, e = _solve(measured, full, theta, weights, allowed)
    covariance = _covariance(rows, e, weights, allowed)[:k, :k]
    spread = float(np.sqrt(np.mean(weights * e**2)))
    residual = measured - full @ values
    return Fit(values[:k], np.sqrt(np.diag(covariance)), covariance, spread, theta, residual)


def whiten(values: Floats, theta: float) -> Floats:
    """Return the one-step errors of the steady filter along axis 0, started at zero."""
    steps = np.diff(values, axis=0, prepend=0.0)
    if theta == 0.0:
        return steps
    n = len(values)
    size = 1 << (2 * n - 1).bit_length()
    response = theta ** np.arange(n)
    spectrum = np.fft.rfft(steps, size, axis=0)
    shape = (-1, *(1,) * (values.ndim - 1))
    product = spectrum * np.fft.rfft(response, size).reshape(shape)
    return np.asarray(np.fft.irfft(product, size, axis=0)[:n], dtype=np.float64)


def _solve(
    measured: Floats, columns: Floats, theta: float, weights: Floats, allowed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return factors, whitened columns `(n, axes, k)` and whitened residual `(n, axes)`."""
    rows, y = whiten(columns, theta), whiten(measured, theta)
    scale = np.sqrt(np.einsum("nak,nak->k", rows, rows)) + 1e-12
    unit = rows / scale
    normal = np.einsum("nak,nal,na->kl", unit, unit, weights)
    right = np.einsum("nak,na,na->k", unit, y, weights)
    free = np.linalg.lstsq(normal, right, rcond=1e-12)[0] / scale
    noise = _spread(y - rows @ free)
    normal = normal + np.diag((noise / (allowed * scale)) ** 2)
    values = np.linalg.lstsq(normal, right, rcond=1e-15)[0] / scale
    return values, rows, y - rows @ values


def _spread(e: Floats) -> float:
    """Return the standard deviation, from the median so that outliers do not count."""
    return float(1.4826 * np.median(np.abs(e))) + 1e-12


def _weights(e: Floats) -> Floats:
    bound = HUBER * np.array([_spread(e[:, i]) for i in range(e.shape[1])])
    return np.minimum(1.0, bound / np.maximum(np.abs(e), 1e-12))


def _likeliest(residual: Floats) -> float:
    """Return the theta under which the residual is most likely."""
    centred = residual - residual[0]
    costs = []
    for theta in THETAS:
        e = whiten(centred, theta)
        start = (theta ** np.arange(len(e)))[:, None]
        e = e - start * (start * e).sum(axis=0) / (start**2).sum()
        costs.append(np.log(np.minimum(e**2, (4.0 * _spread(e)) ** 2).mean()))
    return THETAS[int(np.argmin(costs))]


def _covariance(rows: Floats, e: Floats, weights: Floats, allowed: Floats) -> Floats:
    n, _, k = rows.shape
    scale = np.sqrt(np.einsum("nak,nak->k", rows, rows)) + 1e-12
    unit = rows / scale
    variance = float(np.mean(weights * e**2))
    normal = np.einsum("nak,nal,na->kl", unit, unit, weights)
    normal = normal + np.diag(variance / (allowed * scale) ** 2)
    inverse = np.linalg.pinv(normal, rcond=1e-15, hermitian=True)
    scores = np.einsum("nak,na->nk", unit, weights * e)
    edges = np.linspace(0, n, min(BLOCKS, n) + 1).astype(int)[:-1]
    sums = np.add.reduceat(scores, edges, axis=0)
    spread = inverse @ (sums.T @ sums) @ inverse * (len(sums) / max(1, len(sums) - k))
    classical = inverse * variance
    wide = np.sqrt(np.maximum(1.0, np.diag(spread) / np.maximum(np.diag(classical), 1e-300)))
    covariance: Floats = classical * np.outer(wide, wide) / np.outer(scale, scale)
    return covariance
