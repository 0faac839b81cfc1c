"""How far rivals come apart in an experiment: the least that a wrong one must leave unexplained.

`lambda` is the smallest objective that a rival reaches on a noise-free recording of another one,
its own numbers and the car's ordinary ones refitted (T-optimality); its root is in standard
deviations. Below 10 nobody can tell, from 25 on anybody.
"""

from collections.abc import Sequence

import numpy as np

from scm.arrays import Floats
from scm.mismatch.experiment.plan import Planned, Rival, numbers_of
from scm.mismatch.fit import SMALL, TAIL, Fitted, Fitter
from scm.mismatch.library import Knob

ROUNDS = 3


def quick(planned: Planned, rivals: Sequence[Rival]) -> Floats:
    """Return lambda of each rival (column) where another (row) is right, by one linear refit.

    Args:
        planned: Of the first rival's motion.
        rivals: All of them.
    """
    own, knobs = planned.ordinary, [_knobs(r) for r in rivals]
    bases = [numbers_of(r) for r in rivals]
    sets = [*bases]
    sides = [-SMALL if o.mean + SMALL * o.std > o.bounds[1] else SMALL for o in own]
    for o, side in zip(own, sides, strict=True):
        sets.append({**bases[0], o.key: o.mean + side * o.std})
    for rival, mine in zip(rivals, knobs, strict=True):
        for k, knob in enumerate(mine):
            sets.append(numbers_of(_moved(rival, k, _step(knob, float(rival.values[k])))))
    e, _ = planned(sets)
    e = np.nan_to_num(e)
    n, at = len(rivals), len(rivals) + len(own)
    common = (e[:, n:at] - e[:, :1]) / np.array(sides)
    found = np.zeros((n, n))
    for j, mine in enumerate(knobs):
        slopes = e[:, at : at + len(mine)] - e[:, j : j + 1]
        at += len(mine)
        jacobian = np.concatenate((common, slopes), axis=1)
        prior = np.concatenate((np.ones(len(own)), np.full(len(mine), 1e-6)))
        normal = jacobian.T @ jacobian + np.diag(prior)
        gaps = e[:, j : j + 1] - e[:, :n]
        moves = -np.linalg.lstsq(normal, jacobian.T @ gaps, rcond=1e-12)[0]
        left = gaps + jacobian @ moves
        found[:, j] = _loss(left) + prior @ (moves * moves)
        found[j, j] = 0.0
    return found


def exact(planned: Planned, right: int, rivals: Sequence[Rival]) -> Floats:
    """Return lambda of each rival where one is right, refitted with all that is not linear.

    Args:
        planned: Of the motion of the one that is right.
        right: Which.
        rivals: All of them.
    """
    fitter = Fitter(planned, np.ones(len(planned.t)))
    zeros = np.zeros(len(planned.ordinary))
    others = [k for k in range(len(rivals)) if k != right]
    fits = [
        Fitted(
            rivals[k].effects, zeros.copy(), np.array(rivals[k].values), np.zeros(0), 0.0,
            np.zeros((0, 0)),
        )
        for k in others
    ]  # fmt: skip
    fitter.refine(fits, ROUNDS, fresh=True)
    found = np.zeros(len(rivals))
    for k, fitted in zip(others, fits, strict=True):
        found[k] = fitted.q
    return found


def least(lambdas: Floats) -> float:
    """Return the lambda of the pair that comes apart least, whichever of them is right."""
    n = len(lambdas)
    return float(min(lambdas[i, j] for i in range(n) for j in range(n) if i != j))


def _loss(e: Floats) -> Floats:
    return np.asarray((TAIL * np.log1p(e * e / TAIL)).sum(axis=0))


def _knobs(rival: Rival) -> list[Knob]:
    return [knob for effect in rival.effects for knob in effect.knobs]


def _step(knob: Knob, value: float) -> float:
    return -0.5 * knob.step if value + 0.5 * knob.step > knob.bounds[1] else 0.5 * knob.step


def _moved(rival: Rival, k: int, step: float) -> "_Moved":
    values = np.array(rival.values, dtype=np.float64)
    values[k] += step
    return _Moved(rival, values)


class _Moved:
    """A rival with other numbers."""

    def __init__(self, rival: Rival, values: Floats) -> None:
        self.effects, self.values = rival.effects, values
