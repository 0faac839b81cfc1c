"""How far explanations differ in an experiment: the least that a wrong one leaves unexplained.

`lambda` is the smallest objective that an explanation reaches on a noise-free recording of another
one, its own numbers and the car's nominal parameters refitted (T-optimality); its root is in
standard deviations. Below 10 nobody can tell, from 25 on anybody.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Parameter
from scm.mismatch.experiment.plan import Explanation
from scm.mismatch.fit.fitter import FARTHEST, SMALL, TAIL, Fitter
from scm.mismatch.fit.hypothesis import Hypothesis, numbers_of
from scm.mismatch.fit.likelihood import Likelihood, NominalParameter

ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Separation:
    """How far explanations come apart, and with which numbers the wrong ones come nearest.

    Attributes:
        lambdas: Of the column's explanation where the row's is right, (explanations, explanations).
        z: The car's ordinary numbers then, (explanations, explanations, numbers).
        values: Of the explanation's effects, one array a pair.
    """

    lambdas: Floats
    z: Floats
    values: tuple[tuple[Floats, ...], ...]

    @property
    def least(self) -> float:
        """Lambda of the pair that comes apart least, whichever of them is right."""
        off = ~np.eye(len(self.lambdas), dtype=np.bool_)
        return float(self.lambdas[off].min())


def linear_separation(planned: Likelihood, explanations: Sequence[Explanation]) -> Separation:
    """Return how far explanations come apart by one linear refit of each.

    `planned` is of the first explanation's motion.
    """
    own, parameters = planned.nominal, [_parameters(r) for r in explanations]
    n, e = len(explanations), np.nan_to_num(planned(_sets(planned, explanations))[0])
    common = (e[:, n : n + len(own)] - e[:, :1]) / np.array([_side(o) for o in own])
    lambdas, z, at = np.zeros((n, n)), np.zeros((n, n, len(own))), n + len(own)
    values = list[list[Floats]]()
    for j, mine in enumerate(parameters):
        slopes = e[:, at : at + len(mine)] - e[:, j : j + 1]
        at += len(mine)
        jacobian = np.concatenate((common, slopes), axis=1)
        prior = np.concatenate((np.ones(len(own)), np.full(len(mine), 1e-6)))
        normal = jacobian.T @ jacobian + np.diag(prior)
        gaps = e[:, j : j + 1] - e[:, :n]
        moves = -np.linalg.lstsq(normal, jacobian.T @ gaps, rcond=1e-12)[0]
        lambdas[:, j] = _loss(gaps + jacobian @ moves) + prior @ (moves * moves)
        z[:, j] = np.clip(moves[: len(own)].T, -FARTHEST, FARTHEST)
        values.append([_moved(explanations[j], mine, move) for move in moves[len(own) :].T])
    np.fill_diagonal(lambdas, 0.0)
    return Separation(lambdas, z, tuple(zip(*values, strict=True)))


def refitted_separation(
    plan: Callable[[Explanation], Likelihood],
    explanations: Sequence[Explanation],
    start: Separation,
) -> Separation:
    """Return how far explanations come apart when each is refitted with all that is not linear.

    `plan` gives the recordings that a right explanation would leave. What the linear refit `start`
    could explain counts as explained.
    """
    lambdas = start.lambdas.copy()
    for i, right in enumerate(explanations):
        planned = plan(right)
        others = [j for j in range(len(explanations)) if j != i]
        none = np.zeros(0)
        fits = [
            Hypothesis(planned, explanations[j].effects, start.z[i, j], start.values[i][j],
                       none, 0.0, np.zeros((0, 0)))
            for j in others
        ]  # fmt: skip
        refined = Fitter(planned, np.ones(len(planned.t))).refine(fits, ROUNDS, fresh=True)
        for j, fitted in zip(others, refined, strict=True):
            lambdas[i, j] = min(lambdas[i, j], fitted.score)
    return Separation(lambdas, start.z, start.values)


def _sets(planned: Likelihood, explanations: Sequence[Explanation]) -> list[dict[str, float]]:
    """Return each explanation's numbers, then small steps of the car's own, then of every knob."""
    bases = [numbers_of(r.effects, r.values) for r in explanations]
    sets = list(bases)
    sets += [{**bases[0], o.key: o.mean + _side(o) * o.std} for o in planned.nominal]
    for explanation in explanations:
        for k, parameter in enumerate(_parameters(explanation)):
            values = np.array(explanation.values, dtype=np.float64)
            values[k] += _step(parameter, values[k])
            sets.append(numbers_of(explanation.effects, values))
    return sets


def _loss(e: Floats) -> Floats:
    return np.asarray((TAIL * np.log1p(e * e / TAIL)).sum(axis=0))


def _parameters(explanation: Explanation) -> list[Parameter]:
    return [parameter for effect in explanation.effects for parameter in effect.parameters]


def _side(nominal: NominalParameter) -> float:
    """Return a small step of an ordinary number that stays within its bounds."""
    o = nominal
    return -SMALL if o.mean + SMALL * o.std > o.bounds[1] else SMALL


def _step(parameter: Parameter, value: float) -> float:
    return (
        -0.5 * parameter.step
        if value + 0.5 * parameter.step > parameter.bounds[1]
        else 0.5 * parameter.step
    )


def _moved(explanation: Explanation, parameters: Sequence[Parameter], move: Floats) -> Floats:
    """Return an explanation's values moved by so many of the small steps, within their bounds."""
    values = np.array(explanation.values, dtype=np.float64)
    for k, parameter in enumerate(parameters):
        values[k] += move[k] * _step(parameter, values[k])
        values[k] = min(max(values[k], parameter.bounds[0]), parameter.bounds[1])
    return values
