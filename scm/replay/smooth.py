"""Smooths a noisy channel with a Kalman smoother that needs no car model.

Between samples the acceleration is a random walk (white jerk). Its intensity is chosen by maximum
likelihood, once for the whole channel.
"""

from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel

JERKS = np.logspace(-6.0, 6.0, 13)  # spectral density, in unit^2/s^5, tried


@dataclass(frozen=True, slots=True)
class Smooth:
    """A smoothed channel at its samples: value, rate, their standard deviations, all (n,)."""

    t: Floats
    value: Floats
    rate: Floats
    std: Floats
    rate_std: Floats

    def at(self, t: Floats) -> Floats:
        """Return the value at other times, by cubics that meet value and rate; held beyond."""
        t = np.clip(t, self.t[0], self.t[-1])
        i = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, len(self.t) - 2)
        h = self.t[i + 1] - self.t[i]
        s = (t - self.t[i]) / h
        a, b = self.value[i], self.value[i + 1]
        da, db = self.rate[i] * h, self.rate[i + 1] * h
        turned: Floats = a + s * (
            da + s * (3.0 * (b - a) - 2.0 * da - db + s * (2.0 * (a - b) + da + db))
        )
        return turned

    def rate_at(self, t: Floats) -> Floats:
        """Return the rate at other times."""
        return np.interp(t, self.t, self.rate)


def smooth(t: Floats, values: Floats, std: float) -> Smooth:
    """Smooth a channel of known noise; `t` rises strictly.

    Args:
        t: Times, (n,), n >= 4 [s].
        values: (n,).
        std: Of the noise of one sample.
    """
    likelihoods = [float(_smoothed(t, values, std * std, q)[0, 4]) for q in JERKS]
    best = float(JERKS[int(np.argmax(likelihoods))])
    result = _smoothed(t, values, std * std, best)
    return Smooth(t, result[:, 0], result[:, 1], result[:, 2], result[:, 3])


def _smoothed(t: Floats, values: Floats, variance: float, q: float) -> Floats:
    """Return value, rate, their stds, and the log-likelihood in [0, 4], shape (n, 5)."""
    n, out = len(t), np.zeros((len(t), 5))
    spread = max(float(np.ptp(values)), 1e-6) / max(float(t[-1] - t[0]), 1e-3)
    start = np.array([variance, (100.0 * spread) ** 2, (1e3 * spread) ** 2])
    room = np.zeros((6, 3, 3))
    _both_ways(
        t, values, variance, q, start, np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, 3)),
        np.zeros((n, 3, 3)), room, out,
    )  # fmt: skip
    return out


@array_kernel
def _both_ways(
    t: Floats, values: Floats, variance: float, q: float, start: Floats, state: Floats,
    cov: Floats, ahead: Floats, ahead_cov: Floats, room: Floats, out: Floats,
) -> None:  # fmt: skip
    """Filter forward into the given arrays, then smooth backward into `out`."""
    likelihood = 0.0
    for k in range(len(t)):
        if k == 0:
            ahead[0, 0] = values[0]
            for i in range(3):
                ahead_cov[0, i, i] = start[i]
        else:
            _advance(state[k - 1], cov[k - 1], t[k] - t[k - 1], q, ahead[k], ahead_cov[k], room)
        s = ahead_cov[k, 0, 0] + variance
        rest = values[k] - ahead[k, 0]
        if k > 3:
            likelihood -= 0.5 * (np.log(s) + rest * rest / s)
        for i in range(3):
            gain = ahead_cov[k, i, 0] / s
            state[k, i] = ahead[k, i] + gain * rest
            for j in range(3):
                cov[k, i, j] = ahead_cov[k, i, j] - gain * ahead_cov[k, 0, j]
    for k in range(len(t) - 1, -1, -1):
        if k < len(t) - 1:
            _step_back(
                state[k + 1], cov[k + 1], state[k], cov[k], ahead[k + 1], ahead_cov[k + 1],
                t[k + 1] - t[k], room,
            )  # fmt: skip
        out[k, 0], out[k, 1] = state[k, 0], state[k, 1]
        out[k, 2], out[k, 3] = np.sqrt(max(cov[k, 0, 0], 0.0)), np.sqrt(max(cov[k, 1, 1], 0.0))
    out[0, 4] = likelihood


@array_kernel
def _advance(
    x: Floats, p: Floats, h: float, q: float, x_new: Floats, p_new: Floats, room: Floats
) -> None:
    """Carry state and covariance over a step of `h`."""
    f = room[0]
    _transition(f, h)
    for i in range(3):
        x_new[i] = f[i, 0] * x[0] + f[i, 1] * x[1] + f[i, 2] * x[2]
    _through(f, p, room[1], p_new)
    p_new[0, 0] += q * h**5 / 20.0
    p_new[0, 1] += q * h**4 / 8.0
    p_new[1, 0] += q * h**4 / 8.0
    p_new[0, 2] += q * h**3 / 6.0
    p_new[2, 0] += q * h**3 / 6.0
    p_new[1, 1] += q * h**3 / 3.0
    p_new[1, 2] += q * h**2 / 2.0
    p_new[2, 1] += q * h**2 / 2.0
    p_new[2, 2] += q * h


@array_kernel
def _transition(f: Floats, h: float) -> None:
    for i in range(3):
        for j in range(3):
            f[i, j] = 1.0 if i == j else 0.0
    f[0, 1], f[0, 2], f[1, 2] = h, 0.5 * h * h, h


@array_kernel
def _through(f: Floats, p: Floats, half: Floats, new: Floats) -> None:
    """Write f p f' into `new`."""
    for i in range(3):
        for j in range(3):
            half[i, j] = f[i, 0] * p[0, j] + f[i, 1] * p[1, j] + f[i, 2] * p[2, j]
    for i in range(3):
        for j in range(3):
            new[i, j] = half[i, 0] * f[j, 0] + half[i, 1] * f[j, 1] + half[i, 2] * f[j, 2]


@array_kernel
def _invert(a: Floats, out: Floats) -> None:
    """Write the inverse of a 3 x 3 matrix, by cofactors."""
    for i in range(3):
        for j in range(3):
            r, s, u, v = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            out[i, j] = a[r, u] * a[s, v] - a[r, v] * a[s, u]
    size = a[0, 0] * out[0, 0] + a[0, 1] * out[1, 0] + a[0, 2] * out[2, 0]
    for i in range(3):
        for j in range(3):
            out[i, j] /= size


@array_kernel
def _step_back(
    later: Floats, later_cov: Floats, x: Floats, p: Floats, ahead: Floats, ahead_cov: Floats,
    h: float, room: Floats,
) -> None:  # fmt: skip
    """One step of the Rauch-Tung-Striebel smoother, into `x` and `p`."""
    f, half, gain, inverse, change = room[0], room[1], room[2], room[3], room[4]
    _transition(f, h)
    _invert(ahead_cov, inverse)
    for i in range(3):
        for j in range(3):
            half[i, j] = p[i, 0] * f[j, 0] + p[i, 1] * f[j, 1] + p[i, 2] * f[j, 2]
    for i in range(3):
        for j in range(3):
            gain[i, j] = 0.0
            for k in range(3):
                gain[i, j] += half[i, k] * inverse[k, j]
    for i in range(3):
        for j in range(3):
            x[i] += gain[i, j] * (later[j] - ahead[j])
            change[i, j] = later_cov[i, j] - ahead_cov[i, j]
    _through(gain, change, half, room[5])
    for i in range(3):
        for j in range(3):
            p[i, j] += room[5, i, j]
