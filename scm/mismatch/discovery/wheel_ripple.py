"""Torque over a wheel's turn: what waves of each whole number in a turn would explain.

A ripple is quicker than the moments of `cells`, so each wave is driven once, a sine and a cosine.
"""

import math
from collections.abc import Iterator
from functools import cache

import numpy as np

from scm.arrays import Floats
from scm.mismatch.discovery.dictionary import PHASE, dictionary
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, Values
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis

WAVES = tuple(float(n) for n in range(1, 13))
SIZE = 0.01  # of the torque on a wheel that would lift the car: small, so that all is linear
_HALVES = (0.0, 0.5 * math.pi)


@cache
def by_turn() -> DictionaryEffect:
    """Return the effect of a torque over a wheel's turn."""
    return next(effect for effect in dictionary() if effect.curve is PHASE)


def ripples(fitter: Fitter, base: Hypothesis) -> Iterator[tuple[Values, float]]:
    """Yield the best torque of each number of waves in a turn, and what it would explain."""
    slope, bend = waves_response(fitter, base)
    for i, waves in enumerate(WAVES):
        both = slice(2 * i, 2 * i + 2)
        sine, cosine = map(float, -np.linalg.pinv(bend[both, both]) @ slope[both])
        gain = -float(slope[both] @ (sine, cosine))
        yield (math.hypot(sine, cosine), waves, math.atan2(cosine, sine)), gain


def waves_response(fitter: Fitter, base: Hypothesis) -> tuple[Floats, Floats]:
    """Return slope and bend of the objective by a sine and a cosine [N*m] of each of `WAVES`."""
    model, values = fitter.model, base.numbers
    amount = SIZE * 9.81 * model.car.value("body.mass_kg") * model.car.value("wheel.radius_m")
    waves = [by_turn().numbers((amount, n, half)) for n in WAVES for half in _HALVES]
    e, _ = model([values, *(values | wave for wave in waves)])
    return beside(fitter, base, (e[:, 1:] - e[:, :1]) / amount)


def beside(fitter: Fitter, base: Hypothesis, felt: Floats) -> tuple[Floats, Floats]:
    """Return slope and bend of the objective by amounts of what is felt, (events, n).

    All that is fitted already follows linearly.
    """
    weights, jacobian = fitter.weights(base.innovations), base.jacobian
    weighted = jacobian.T * weights
    prior = np.full(jacobian.shape[1], 1e-6)
    prior[: len(base.z)] = 1.0
    tilt = weighted @ base.innovations
    tilt[: len(base.z)] += base.z
    own = weighted @ felt
    held = np.linalg.solve(weighted @ jacobian + np.diag(prior), own)
    mine = felt.T * weights
    return mine @ base.innovations - held.T @ tilt, mine @ felt - own.T @ held
