"""Fits to made drives whose answer is known, without a search, for tests of what follows one."""

from functools import cache

import numpy as np

from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood
from tests.unit.mismatch.made_drive import big_nigel, driven


def by_name(found, name):
    """A candidate among some."""
    return next(one for one in found if one.name == name)


def candidate(name):
    return by_name(candidates(big_nigel()), name)


def fitted(drive, **effects):
    """Return model, re-tuned car and car with effects fitted from given values."""
    model = Likelihood.of([drive], big_nigel())
    fitter = Fitter(model, np.ones(len(model.t)))
    (retuned,) = fitter.refine([fitter.unfitted()], rounds=2, fresh=True)
    if not effects:
        return model, retuned, retuned
    chosen = tuple(candidate(name) for name in effects)
    start = np.array([value for values in effects.values() for value in values])
    (best,) = fitter.refine(fitter.begin(retuned, [(chosen, start)]), rounds=2, fresh=True)
    return model, retuned, best


@cache
def healthy():
    return fitted(driven())


@cache
def trimmed():
    return fitted(driven((("steering.trim_rad", 0.05),)), steer_trim=(0.05,))


@cache
def patched():
    """A spot of floor that brakes, on a part of the way."""
    spot = {"x": 0.0, "y": 0.0, "radius": 0.3}
    keys = {f"surface_patch.{name}_m": value for name, value in spot.items()}
    numbers = {**keys, "surface_patch.rolling": 0.2}
    return fitted(driven(tuple(numbers.items())), surface_patch=(0.0, 0.0, 0.3, 1.0, 0.2))


@cache
def biased():
    """A gyro that reads too much, from half of the time on in `late_gyro`."""
    sense = lambda name, _, v: v + 0.05 if name == "imu.gyro_z" else v  # noqa: E731
    return fitted(driven(sense=sense), gyro_bias=(0.05,))


@cache
def both():
    sense = lambda name, _, v: v + 0.05 if name == "imu.gyro_z" else v  # noqa: E731
    drive = driven((("steering.trim_rad", 0.05),), sense=sense)
    return fitted(drive, steer_trim=(0.05,), gyro_bias=(0.05,))
