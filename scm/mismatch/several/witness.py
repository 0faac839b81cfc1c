"""One car's recordings as a witness of an effect: at its own value, at a given one, without it.

What the car's recordings say of the effect's numbers, its own numbers and other effects free, is a
quadratic near any value; normal equations of several cars add up where the value is shared.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scm.arrays import Floats
from scm.mismatch.diagnose import Searched
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.fitter import FARTHEST, Fitted
from scm.mismatch.fit.noise import Noise
from scm.mismatch.fit.noise_fit import learn_noise
from scm.mismatch.fit.residual_windows import independent_share

LOOSE = 1e-6  # precision of a number that nothing tells, in its steps
ROUNDS = 4


@dataclass(frozen=True, slots=True)
class Told:
    """What a car's recordings say about an effect's numbers near some values.

    Attributes:
        cost: Objective there, the price of the noise believed included.
        slope: Half its derivative by the numbers over their steps, (knobs,); `precision`: half the
            second one, (knobs, knobs); the car's own numbers go along as they like.
    """

    values: Floats
    cost: float
    slope: Floats
    precision: Floats
    fitted: Fitted


class Witness:
    """One car, asked about one effect.

    Attributes:
        effect: As this car's search listed it, with bounds that hold the values asked for.
        alone: Whether the car's own diagnosis has it.
        free: At the value that suits this car best.
        needed: What the effect's numbers cost on data that nobody searched.
    """

    def __init__(self, searched: Searched, effect: Candidate, start: Floats) -> None:
        self._searched, self._model = searched, searched.model
        self._fitter = searched.search.fitter
        best = searched.best
        mine = next((e for e in best.effects if is_same(e, effect)), None)
        listed = next((e for e in searched.search.listed if is_same(e, effect)), effect)
        self.alone, self.effect = mine is not None, _holding(mine or listed, effect)
        self._reported = mine or listed  # a search knows the rivals of what it listed itself
        self._others, others = _without(best, mine)
        # A calm estimate of what a stride's misses tell anew holds for all its hypotheses.
        self._worth = independent_share(self._model, best.e) if searched.rough else 1.0
        self.needed = len(effect.parameters) * math.log(max(searched.search.events, 2))
        at = np.asarray(_of(best, mine) if mine is not None else start, dtype=np.float64)
        self._kept: dict[bytes, Told] = {}
        before = self._model.noise
        with_it, learned = self._settled((*self._others, self.effect), (*others, *at), best.z)
        without, other = self._settled(self._others, others, best.z)
        self._noises = _unlike(before, learned, other)
        costs = [self._under(noise, with_it, without) for noise in self._noises]
        with_it, _, noise = min(costs, key=lambda c: self._cost_under(c[2], c[0]))
        self.cost_without = min(self._cost_under(c[2], c[1]) for c in costs)
        self._model.believe(noise)
        self._noise, self._last = noise, with_it
        self.free = self._told(with_it)

    def at(self, values: Floats) -> Told:
        """Return what the recordings say where the effect has these values, all else free."""
        key = np.round(values, 9).tobytes()
        if key not in self._kept:
            self._model.believe(self._noise)
            parameters = [
                replace(parameter, bounds=(float(v), float(v)))
                for parameter, v in zip(self.effect.parameters, values, strict=True)
            ]
            held = replace(self.effect, parameters=tuple(parameters))
            others = _first(self._last, len(self._last.values) - len(values))
            begun = self._begun((*self._others, held), (*others, *values), self._last.z)
            self._kept[key] = self._told(self._fit(begun))
        return self._kept[key]

    def gain(self, told: Told) -> float:
        """Return how much better the recordings are explained than without the effect."""
        return self.cost_without - told.cost

    def taken(self, told: Told) -> Searched:
        """Return the car's search with the effect at these values in its model."""
        self._model.believe(self._noise)
        fitted = replace(told.fitted, effects=(*self._others, self._reported))
        return replace(self._searched, best=fitted)

    def left(self) -> None:
        """Believe again what the car's own model was fitted under."""
        self._model.believe(self._noises[0])

    def _settled(
        self, effects: tuple[Candidate, ...], values: Sequence[float], z: Floats
    ) -> tuple[Fitted, Noise]:
        """Return a hypothesis refitted, and the noise that it leaves."""
        fitted = self._fit(self._begun(effects, values, z))
        if self._searched.rough:
            return fitted, self._model.noise
        before = self._model.noise
        numbers = self._fitter.numbers(fitted.effects, fitted.z, fitted.values)
        residuals, _ = self._model.residuals([numbers])
        learned = learn_noise(self._model, residuals, 1)
        self._model.believe(before)
        return fitted, learned

    def _under(self, noise: Noise, *fits: Fitted) -> tuple[Fitted, Fitted, Noise]:
        """Return the two hypotheses refitted under a belief about noise."""
        self._model.believe(noise)
        with_it, without = (self._fit(self._begun(f.effects, f.values, f.z)) for f in fits)
        return with_it, without, noise

    def _begun(
        self, effects: tuple[Candidate, ...], values: Sequence[float] | Floats, z: Floats
    ) -> Fitted:
        empty = np.zeros((0, 0))
        return Fitted(
            effects, z.copy(), np.asarray(values, dtype=np.float64), np.zeros(0), 0.0, empty
        )

    def _fit(self, begun: Fitted) -> Fitted:
        return self._fitter.refine([begun], rounds=ROUNDS, fresh=True)[0]

    def _cost_under(self, noise: Noise, fitted: Fitted) -> float:
        if self._model.noise != noise:
            self._model.believe(noise)
        return self._cost(fitted)

    def _cost(self, fitted: Fitted) -> float:
        return self._worth * (fitted.q + float(self._fitter.part @ self._model.log_size))

    def _told(self, fitted: Fitted) -> Told:
        """Return the quadratic in the last effect's numbers, all others profiled out."""
        count = len(self.effect.parameters)
        weights = self._fitter.weights(fitted.e)
        own, known = len(fitted.z), len(fitted.z) + len(fitted.values)
        prior = np.concatenate((np.ones(own), np.full(known - own, LOOSE)))
        pull = np.concatenate((fitted.z, np.zeros(known - own)))
        normal = fitted.jacobian.T @ (weights[:, None] * fitted.jacobian) + np.diag(prior)
        slope = fitted.jacobian.T @ (weights * fitted.e) + pull
        moves = np.ones(known, dtype=np.bool_)
        moves[:own] = np.abs(fitted.z) < FARTHEST - 1e-6  # a number at its limit stays there
        moves[known - count :] = False
        cross = normal[known - count :][:, moves]
        through = np.linalg.solve(normal[np.ix_(moves, moves)], np.eye(int(moves.sum())))
        precision = normal[known - count :, known - count :] - cross @ through @ cross.T
        pulled = slope[known - count :] - cross @ (through @ slope[moves])
        return Told(
            fitted.values[-count:].copy(), self._cost(fitted), self._worth * pulled,
            self._worth * precision, fitted,
        )  # fmt: skip


def is_same(one: Candidate, other: Candidate) -> bool:
    """Say whether two effects, listed for different cars, are the same with the same numbers."""
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


def _without(best: Fitted, mine: Candidate | None) -> tuple[tuple[Candidate, ...], list[float]]:
    """Return a model's other effects, and their values."""
    effects, values, at = list[Candidate](), list[float](), 0
    for effect in best.effects:
        if effect is not mine:
            effects.append(effect)
            values += [float(v) for v in best.values[at : at + len(effect.parameters)]]
        at += len(effect.parameters)
    return tuple(effects), values


def _of(best: Fitted, mine: Candidate) -> Floats:
    """Return the values of one effect of a model."""
    at = 0
    for effect in best.effects:
        if effect is mine:
            break
        at += len(effect.parameters)
    return np.asarray(best.values[at : at + len(mine.parameters)])


def _first(fitted: Fitted, count: int) -> Floats:
    return np.asarray(fitted.values[:count])


def _unlike(*noises: Noise) -> list[Noise]:
    found = list[Noise]()
    for noise in noises:
        if noise not in found:
            found.append(noise)
    return found
