"""Gusts: wind as a function of time and seed only, so it is the same for everybody.

    v(t) = mean + sigma * sqrt(2 / n) * sum of cos(w_k t + phase_k),   w_k = tan(pi/2 * q_k) / tau

The frequencies are quantiles of the Lorentz curve, which is the spectrum of a first-order gust:
its correlation is exp(-|t1 - t0| / tau).   Holds: for a map smaller than a gust.
Source: spectral sum for a process of given spectrum (M. Shinozuka, G. Deodatis, 1991).
"""

import math

import numpy as np

from scm.clock import NS_PER_S
from scm.records.floor import Wind

WAVES = 64


class Gusts:
    """The wind of a map.

    Args:
        wind: Mean velocity, strength and length of gusts.
        seed: Of the phases.
    """

    def __init__(self, wind: Wind, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x77696E64])
        quantiles = (np.arange(WAVES) + rng.uniform(0.1, 0.9, (2, WAVES))) / WAVES
        self._mean = np.array([[wind.x_mps], [wind.y_mps]])
        self._rates = np.tan(0.5 * math.pi * quantiles) / wind.gust_s
        self._phases = rng.uniform(0.0, 2.0 * math.pi, (2, WAVES))
        self._height = wind.gust_mps * math.sqrt(2.0 / WAVES)

    def at(self, t_ns: int) -> tuple[float, float]:
        """Return the wind's velocity at an instant, map x and y [m/s]."""
        if self._height == 0.0:
            return float(self._mean[0, 0]), float(self._mean[1, 0])
        waves = np.cos(self._rates * (t_ns / NS_PER_S) + self._phases)
        x, y = self._mean[:, 0] + self._height * waves.sum(axis=1)
        return float(x), float(y)
