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
        float(_filtered(t, values, float(q), white, lasting, lasts_s, start))
        for white, q in product(whites, JERKS)
    )


@array_kernel
def _filtered(
    t: Floats, values: Floats, q: float, white: float, lasting: float, lasts_s: float, start: Floats
) -> float:
    """Return the log-likelihood of value, rate, acceleration and noise that lasts, filtered.

    The four have one covariance, of which half is written out: thousands of filters run a drive.
    """
    x0, x1, x2, x3 = values[0], 0.0, 0.0, 0.0
    p00, p11, p22, p33 = start[0], start[1], start[2], lasting
    p01 = p02 = p03 = p12 = p13 = p23 = found = h = half = stays = 0.0
    for k in range(len(t)):
        if k > 0:
            if t[k] - t[k - 1] != h:
                h = t[k] - t[k - 1]
                half, stays = 0.5 * h * h, np.exp(-h / lasts_s)
            x0 += h * x1 + half * x2
            x1 += h * x2
            x3 *= stays
            p00 += h * p01 + half * p02
            p01 += h * p11 + half * p12
            p02 += h * p12 + half * p22
            p03 += h * p13 + half * p23
            p11 += h * p12
            p12 += h * p22
            p13 += h * p23
            p00 += h * p01 + half * p02 + q * h**5 / 20.0
            p01 += h * p02 + q * h**4 / 8.0
            p11 += h * p12 + q * h**3 / 3.0
            p02 += q * h**3 / 6.0
            p12 += q * h**2 / 2.0
            p22 += q * h
            p03, p13, p23 = stays * p03, stays * p13, stays * p23
            p33 = stays * stays * p33 + lasting * (1.0 - stays * stays)
        size = p00 + 2.0 * p03 + p33 + white
        rest = values[k] - x0 - x3
        if k > 3:
            found -= 0.5 * (np.log(size) + rest * rest / size)
        # of each of the four, what it has in common with the value that is seen
        c0, c1, c2, c3 = p00 + p03, p01 + p13, p02 + p23, p03 + p33
        g0, g1, g2, g3 = c0 / size, c1 / size, c2 / size, c3 / size
        x0, x1, x2, x3 = x0 + g0 * rest, x1 + g1 * rest, x2 + g2 * rest, x3 + g3 * rest
        p00, p01, p02, p03 = p00 - g0 * c0, p01 - g0 * c1, p02 - g0 * c2, p03 - g0 * c3
        p11, p12, p13 = p11 - g1 * c1, p12 - g1 * c2, p13 - g1 * c3
        p22, p23, p33 = p22 - g2 * c2, p23 - g2 * c3, p33 - g3 * c3
    return found
