"""What one car's recordings show of an effect: at its own value, at a given one, without it.

Near any value that is a quadratic in the effect's numbers, the car's own numbers and its other
effects free; normal equations of several cars add up where the value is shared.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.fitter import FARTHEST
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import fit_noise
from scm.mismatch.fit.residual_windows import independent_share
from scm.mismatch.select.selected import Selected

LOOSE = 1e-6  # precision of a number that nothing shows, in its steps
ROUNDS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """What a car's recordings show of an effect's numbers near some values.

    Attributes:
        cost: Objective there, the cost of the noise model included.
        slope: Half its derivative by the numbers over their steps, (parameters,); `precision`: half
            the second one, (parameters, parameters); the car's own numbers follow freely.
    """

    values: Floats
    cost: float
    slope: Floats
    precision: Floats
    fitted: Hypothesis


class EffectInCar:
    """One effect in one car's recordings.

    Attributes:
        effect: As in this car's catalogue, with bounds that hold the values of all cars.
        alone: Whether the car's own diagnosis has it.
        free: At the value that suits this car best.
        needed: What the effect's numbers cost on data that nobody searched.
        cost_without: Objective without the effect.
    """

    def __init__(self, selected: Selected, effect: Candidate, start: Floats) -> None:
        self._selected, self._context, best = selected, selected.context, selected.best
        mine = next((e for e in best.effects if is_same(e, effect)), None)
        known = next((e for e in self._context.catalogue if is_same(e, effect)), effect)
        self.alone, self.effect = mine is not None, _holding(mine or known, effect)
        self._reported = mine or known  # a selection knows the alternatives of its own effects
        at = start if mine is None else best.values[best.place_of(mine)]
        without = _without(best, mine)
        # One estimate of what a window's misses share holds for all hypotheses of the car.
        by_windows = self._context.by_windows
        self._share = independent_share(best.model, best.innovations) if by_windows else 1.0
        self.needed = len(effect.parameters) * math.log(max(self._context.events, 2))
        with_it = self._fit(_with(without, self.effect, at))
        without = self._fit(without)
        models = _different(best.model, *(self._own_noise(f) for f in (with_it, without)))
        fits = [[self._fit(f, model) for f in (with_it, without)] for model in models]
        self._last = min((pair[0] for pair in fits), key=self._cost)
        self.cost_without = min(self._cost(pair[1]) for pair in fits)
        self.free = self._quadratic(self._last)
        self._known: dict[bytes, Quadratic] = {}

    def at(self, values: Floats) -> Quadratic:
        """Return what the recordings show where the effect has these values, all else free."""
        key = np.round(values, 9).tobytes()
        if key not in self._known:
            fixed = [
                replace(parameter, bounds=(float(v), float(v)))
                for parameter, v in zip(self.effect.parameters, values, strict=True)
            ]
            effect = replace(self.effect, parameters=tuple(fixed))
            begun = _with(_without(self._last, self._last.effects[-1]), effect, values)
            self._known[key] = self._quadratic(self._fit(begun))
        return self._known[key]

    def gain(self, there: Quadratic) -> float:
        """Return how much better the recordings are explained than without the effect."""
        return self.cost_without - there.cost

    def selected_with(self, there: Quadratic) -> Selected:
        """Return the car's selection with the effect at these values in its hypothesis."""
        effects = (*there.fitted.effects[:-1], self._reported)
        selection = replace(self._selected.selection, best=replace(there.fitted, effects=effects))
        return replace(self._selected, selection=selection)

    def _own_noise(self, fitted: Hypothesis) -> Likelihood:
        """Return the likelihood under the noise that a hypothesis leaves."""
        if self._context.by_windows:
            return fitted.model
        residuals, _ = fitted.model.residuals([fitted.numbers])
        return fit_noise(fitted.model, residuals, 1)

    def _fit(self, begun: Hypothesis, model: Likelihood | None = None) -> Hypothesis:
        begun = replace(begun, score=0.0, jacobian=np.zeros((0, 0)))
        fitter = self._context.fitter(model or begun.model)
        return fitter.refine([begun], rounds=ROUNDS, fresh=True)[0]

    def _cost(self, fitted: Hypothesis) -> float:
        part = self._context.fitter(fitted.model).part
        return self._share * (fitted.score + float(part @ fitted.model.log_size))

    def _quadratic(self, fitted: Hypothesis) -> Quadratic:
        """Return the quadratic in the last effect's numbers, all others profiled out."""
        count, e = len(self.effect.parameters), fitted.innovations
        weights = self._context.fitter(fitted.model).weights(e)
        own, known = len(fitted.z), len(fitted.z) + len(fitted.values)
        prior = np.concatenate((np.ones(own), np.full(known - own, LOOSE)))
        pull = np.concatenate((fitted.z, np.zeros(known - own)))
        normal = fitted.jacobian.T @ (weights[:, None] * fitted.jacobian) + np.diag(prior)
        slope = fitted.jacobian.T @ (weights * e) + pull
        moves = np.ones(known, dtype=np.bool_)
        moves[:own] = np.abs(fitted.z) < FARTHEST - 1e-6  # a number at its limit stays there
        moves[known - count :] = False
        cross = normal[known - count :][:, moves]
        through = np.linalg.solve(normal[np.ix_(moves, moves)], np.eye(int(moves.sum())))
        precision = normal[known - count :, known - count :] - cross @ through @ cross.T
        pulled = slope[known - count :] - cross @ (through @ slope[moves])
        return Quadratic(
            fitted.values[-count:], self._cost(fitted), self._share * pulled,
            self._share * precision, fitted,
        )  # fmt: skip


def is_same(one: Candidate, other: Candidate) -> bool:
    """Return whether two effects, of the catalogues of different cars, have the same numbers."""
    return one.name == other.name and [(k.name, k.key) for k in one.parameters] == [
        (k.name, k.key) for k in other.parameters
    ]


def _holding(effect: Candidate, other: Candidate) -> Candidate:
    """Return an effect whose numbers may be where another car's may: floors are one."""
    parameters = tuple(
        replace(k, bounds=(min(k.bounds[0], o.bounds[0]), max(k.bounds[1], o.bounds[1])))
        for k, o in zip(effect.parameters, other.parameters, strict=True)
    )
    return replace(effect, parameters=parameters)


def _without(best: Hypothesis, effect: Candidate | None) -> Hypothesis:
    """Return a hypothesis without one of its effects, not refitted."""
    if effect is None:
        return best
    others = tuple(e for e in best.effects if e is not effect)
    return replace(best, effects=others, values=np.delete(best.values, best.place_of(effect)))


def _with(base: Hypothesis, effect: Candidate, values: Sequence[float] | Floats) -> Hypothesis:
    """Return a hypothesis with one effect more, not refitted."""
    more = np.concatenate((base.values, np.asarray(values, dtype=np.float64)))
    return replace(base, effects=(*base.effects, effect), values=more)


def _different(*models: Likelihood) -> list[Likelihood]:
    """Return likelihoods of different noise models, each once."""
    found = list[Likelihood]()
    for model in models:
        if all(model.noise != one.noise for one in found):
            found.append(model)
    return found
