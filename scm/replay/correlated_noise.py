"""Whether the noise of a channel lasts from one sample to the next, as that of many trackers does.

A motion whose acceleration is a random walk (white jerk), seen with white noise, with first-order
Gauss-Markov noise, or with both: the likelihood of a Kalman filter says which it is. No car model
is needed, so what a car does differently from its model is not taken for noise.
"""

import math
from collections.abc import Sequence
from itertools import product, starmap
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats
from scm.vehicles.jit import array_kernel

JERKS = np.logspace(-6.0, 6.0, 13)  # spectral density, in unit^2/s^5, tried
SIZES = 1.0, 0.7, 0.5, 0.35, 0.25, 0.15  # of white noise, tried, of the std stated
SHARES = 0.99, 0.9, 0.7  # of the variance that lasts
LASTS_S = 0.05, 0.1, 0.2, 0.4  # longer: no drive tells it from the motion
SMOOTH = (
    0.6  # of the standard deviation stated: what differs by more from sample to sample is white
)
MIN_GAIN = 30.0  # of the log-likelihood


class Correlated(NamedTuple):
    """Noise that lasts.

    Attributes:
        share: Of the variance, 0..1; the rest is white.
        lasts_s: How long it lasts, the time constant.
    """

    share: float = 0.0
    lasts_s: float = 0.0

    def inflation(self, every_s: float) -> float:
        """Return how much larger white noise is that leaves a slow motion as unsure."""
        if self.share == 0.0:
            return 1.0
        stays = math.exp(-every_s / self.lasts_s)
        return math.sqrt(1.0 + self.share * ((1.0 + stays) / (1.0 - stays) - 1.0))

    def drawn(self, t: Floats, rng: np.random.Generator) -> Floats:
        """Return noise of standard deviation 1 at given times, (n,)."""
        white = rng.standard_normal(len(t))
        if self.share == 0.0:
            return white
        stays = np.exp(-np.diff(t) / self.lasts_s)
        lasting = rng.standard_normal(len(t))
        for k, stay in enumerate(stays, start=1):
            lasting[k] = stay * lasting[k - 1] + math.sqrt(1.0 - stay * stay) * lasting[k]
        return math.sqrt(1.0 - self.share) * white + math.sqrt(self.share) * lasting


WHITE_NOISE = Correlated()


def correlated_noise(channels: Sequence[tuple[Floats, Floats, float]]) -> Correlated:
    """Return how much of a tracker's noise lasts, and how long: one answer for all it measures.

    Noise that is smaller than stated, and white, explains a smooth channel too: what lasts must
    explain it better.

    Args:
        channels: Of each its times, rising strictly [s], its values, and the standard deviation
            of the noise of one, as stated.
    """
    if all(roughness(values) > SMOOTH * std for _, values, std in channels):
        return WHITE_NOISE
    tried = [WHITE_NOISE, *starmap(Correlated, product(SHARES, LASTS_S))]
    found = [sum(_likelihood(*channel, one) for channel in channels) for one in tried]
    best = int(np.argmax(found))
    return tried[best] if found[best] > found[0] + MIN_GAIN else WHITE_NOISE


def roughness(values: Floats) -> float:
    """Return the white noise that a channel's third differences show, whose median motion is slow.

    At least 1e-6, so that it can be divided by.
    """
    jumps = np.diff(values, 3)
    moving = jumps[jumps != 0.0] if np.any(jumps) else jumps
    return max(MAD * float(np.median(np.abs(moving))) / math.sqrt(20.0), 1e-6)


MAD = 1.4826  # standard deviations in a median absolute deviation


def _likelihood(t: Floats, values: Floats, std: float, noise: Correlated) -> float:
    """Return the log-likelihood under the best intensity of the jerk; white noise may be less."""
    spread = max(float(np.ptp(values)), 1e-6) / max(float(t[-1] - t[0]), 1e-3)
    start = np.array([std * std, (100.0 * spread) ** 2, (1e3 * spread) ** 2])
    lasting, lasts_s = noise.share * std * std, noise.lasts_s or 1.0
    whites = [std * std - lasting] if noise.share else [(size * std) ** 2 for size in SIZES]
    return max(
        float(_filtered(t, values, float(q), white, lasting, lasts_s, start, np.zeros((3, 4, 4))))
        for white, q in product(whites, JERKS)
    )


@array_kernel
def _filtered(
    t: Floats, values: Floats, q: float, white: float, lasting: float, lasts_s: float,
    start: Floats, room: Floats,
) -> float:  # fmt: skip
    """Return the log-likelihood of value, rate, acceleration and noise that lasts, filtered."""
    p, f, half = room[0], room[1], room[2]
    x, gain, found = np.zeros(4), np.zeros(4), 0.0
    x[0] = values[0]
    for i in range(3):
        p[i, i], f[i, i] = start[i], 1.0
    p[3, 3] = lasting
    for k in range(len(t)):
        if k > 0:
            h = t[k] - t[k - 1]
            f[0, 1], f[0, 2], f[1, 2], f[3, 3] = h, 0.5 * h * h, h, np.exp(-h / lasts_s)
            x[0] += h * x[1] + 0.5 * h * h * x[2]
            x[1] += h * x[2]
            x[3] *= f[3, 3]
            _through(f, p, half)
            p[0, 0] += q * h**5 / 20.0
            p[0, 1] += q * h**4 / 8.0
            p[1, 0] += q * h**4 / 8.0
            p[0, 2] += q * h**3 / 6.0
            p[2, 0] += q * h**3 / 6.0
            p[1, 1] += q * h**3 / 3.0
            p[1, 2] += q * h**2 / 2.0
            p[2, 1] += q * h**2 / 2.0
            p[2, 2] += q * h
            p[3, 3] += lasting * (1.0 - f[3, 3] ** 2)
        size = p[0, 0] + 2.0 * p[0, 3] + p[3, 3] + white
        rest = values[k] - x[0] - x[3]
        if k > 3:
            found -= 0.5 * (np.log(size) + rest * rest / size)
        for i in range(4):
            gain[i] = p[i, 0] + p[i, 3]
        for i in range(4):
            x[i] += gain[i] / size * rest
            for j in range(4):
                p[i, j] -= gain[i] / size * gain[j]
    return found


@array_kernel
def _through(f: Floats, p: Floats, half: Floats) -> None:
    """Put f p f' in the place of `p`."""
    for i in range(4):
        for j in range(4):
            half[i, j] = 0.0
            for k in range(4):
                half[i, j] += f[i, k] * p[k, j]
    for i in range(4):
        for j in range(4):
            p[i, j] = 0.0
            for k in range(4):
                p[i, j] += half[i, k] * f[j, k]
