"""Which of many fits are followed: the best of each effect, and where else to begin."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.fit.fitter import Fitted

AFRESH_GAIN = 60.0


def from_each(fitted: Fitted, starts: Sequence[Floats]) -> list[Fitted]:
    """Return copies of a hypothesis, each at other values of the car's own numbers."""
    unlike = {np.round(z, 3).tobytes(): z for z in starts}
    return [
        replace(fitted, z=z.copy(), values=fitted.values.copy(), done=False)
        for z in unlike.values()
    ]


def preferred(near: Sequence[Fitted], far: Sequence[Fitted]) -> list[Fitted]:
    """Return, of each last effect, the fit that went far only where re-tuning really hid it."""
    best = {id(fitted.effects[-1]): fitted for fitted in sorted(near, key=lambda f: -f.q)}
    for fitted in far:
        other = best.setdefault(id(fitted.effects[-1]), fitted)
        if fitted.q < other.q - AFRESH_GAIN:
            best[id(fitted.effects[-1])] = fitted
    return list(best.values())


def next_starts(best: Fitted, fits: Sequence[Fitted]) -> list[Fitted]:
    """Return the best fit of the same one number begun quite elsewhere: valleys may be two."""
    effect, at = best.effects[-1], best.values[-1]
    if len(effect.parameters) != 1:
        return []
    parameter = effect.parameters[0]
    size = abs(at - parameter.neutral)
    far = [
        f for f in fits
        if f.effects[-1] is effect and np.isfinite(f.q) and abs(f.values[-1] - at) > 0.5 * size
    ]  # fmt: skip
    return sorted(far, key=lambda f: f.q)[:1]


def best_of_each(fits: Sequence[Fitted], spots: int) -> list[Fitted]:
    """Return the best fit of each last effect, of one that has a place the best at some spots."""
    best = dict[int, list[Fitted]]()
    for fitted in sorted(fits, key=lambda f: f.q):
        same = best.setdefault(id(fitted.effects[-1]), [])
        if len(same) < (spots if fitted.effects[-1].is_placed else 1):
            same.append(fitted)
    return [fitted for same in best.values() for fitted in same]
