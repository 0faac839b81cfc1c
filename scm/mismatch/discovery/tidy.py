"""Numbers of a law as a person would give them: angles in a turn, waves above zero."""

import math

import numpy as np

from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.fit.fitter import Fitted

_FLIPPED_BY = ("toward_rad", "phase_rad")


def tidied(fitted: Fitted) -> Fitted:
    """Return a hypothesis whose law says the same in smaller numbers."""
    law = fitted.effects[-1]
    if not isinstance(law, DictionaryEffect):
        return fitted
    names = [parameter.name for parameter in law.parameters]
    own = len(fitted.values) - len(names)
    values = dict(zip(names, map(float, fitted.values[own:]), strict=True))
    wave = law.curve.name in ("swing", "wave", "round")
    by = [name for name in (*_FLIPPED_BY, "against_rad") if name in values]
    if values[names[0]] < 0.0 and by and (wave or by[0] == "toward_rad"):
        values[names[0]] *= -1.0
        values[by[0]] += math.pi
        _turn_column(fitted, own)
    for name in names:
        if name.endswith("_rad") and name != names[0]:
            values[name] = math.remainder(values[name], 2.0 * math.pi)
    fitted.values = np.append(fitted.values[:own], list(values.values()))
    return fitted


def _turn_column(fitted: Fitted, own: int) -> None:
    """Turn the sign of the amount in what was differentiated by it."""
    k = len(fitted.z) + own
    if fitted.jacobian.shape[1] > k:
        fitted.jacobian[:, k] *= -1.0
    if len(fitted.covariance) > k:
        fitted.covariance[k, :] *= -1.0
        fitted.covariance[:, k] *= -1.0
