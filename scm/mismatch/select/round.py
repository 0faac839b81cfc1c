"""One round of a selection: try every effect beside a hypothesis, refit the best, rank them.

An effect must gain more than chance gives the best of so many tried one time in fifty: what
chi-squared with as many degrees of freedom as it has numbers exceeds so seldom.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from statistics import NormalDist

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Budget
from scm.mismatch.changing_effect import ChangingEffect
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Equation
from scm.mismatch.fit.fitter import FARTHEST, SPOTS, Fitter, Race, Trial
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import fit_noise
from scm.mismatch.select.changes import (
    changes_to_try,
    has_moments,
    varying_to_try,
    with_best_moments,
)
from scm.mismatch.varying_effect import VaryingEffect

MAX_REFITTED, MAX_REFITTED_FROM_NOMINAL, MAX_OTHER_STARTS = 16, 10, 6
LAST_ROUNDS = 5, 8  # of fits that are compared: of all starts, then of the near ones
BETTER_BASE = 5.0  # gain by an effect's nominal parameters alone that calls for another try
MIN_REFITTED = 4
WORTH_A_FIT = 0.5  # of its penalty, what an effect must gain by a linear guess to be refitted
BENT = 1.0  # standard deviations from its file, beyond which a number may hide an effect
FINALISTS, FINALISTS_WITHIN = 3, 100.0
FALSE_ALARMS = 0.02  # one in fifty
NEAR = 40.0  # score within which a fit may still become the best
AT_LIMIT = 8.0  # what speaks for an effect whose nominal parameter is at its limit
BACK = 1.0  # standard deviations within which a nominal parameter has left its limit
NOMINAL_GAIN = 60.0  # of a fit from the nominal car, so that it takes the re-tuned one's place
TYRE_MODELS = 12.0  # two simulators' tyres, both right, differ by as much on a drive of 90 s
Notify = Callable[[str], None]
FitNoise = Callable[[Likelihood, Sequence[Sequence[Floats]], int], Likelihood]


@dataclass(frozen=True, slots=True)
class Context:
    """What a selection works with, and how.

    Attributes:
        part: Weight of each innovation that it may use, 0 or 1, (events,).
        catalogue: The effects to choose from.
        notify: Receives what is being tried.
        fit_noise: Returns the likelihood under the noise that a fit leaves.
        times_fitted: How often a hypothesis and its noise are fitted: huge disturbances at first
            leave it in the wrong minimum.
        amplifies: Whether effects are begun as strong as suits them, and at several places.
        keeps_derivatives: Of the alternatives of a round; otherwise they would fill memory.
        share_confirmed: Share of an effect's gain that must hold where nothing was fitted.
        by_windows: Whether the likelihood is that of residual windows, which hold more than noise.
        changes: Whether effects may change during a recording.
    """

    part: Floats
    catalogue: tuple[Candidate, ...]
    notify: Notify = lambda _: None
    budget: Budget = field(default_factory=Budget)
    fit_noise: FitNoise = fit_noise
    times_fitted: int = 1
    amplifies: bool = True
    keeps_derivatives: bool = False
    share_confirmed: float = 0.4
    by_windows: bool = False
    changes: bool = True

    @property
    def events(self) -> int:
        """How many innovations count."""
        return int(self.part.sum())

    def fitter(self, model: Likelihood) -> Fitter:
        """Return what fits the part under a model's noise."""
        return Fitter(model, self.part)

    def penalty(self, effects: Sequence[Candidate]) -> float:
        """Return what effects must gain to be accepted: their complexity penalty.

        By windows it is `ln n` a number, for windows hold more than noise.
        """
        if not self.by_windows:
            return penalty(effects, len(self.catalogue))
        numbers = sum(len(effect.parameters) for effect in effects)
        rare = sum(effect.rare for effect in effects)
        size = 2.0 * math.log(len(self.catalogue) / FALSE_ALARMS)
        return rare + numbers * math.log(self.events) + len(effects) * size

    def criterion(self, fitted: Hypothesis) -> float:
        """Return the score and the penalty of its effects; lower is better."""
        return fitted.score + self.penalty(fitted.effects)

    def cost(self, fitted: Hypothesis) -> float:
        """Return the criterion and what the noise model costs: hypotheses of any noise compare."""
        return self.criterion(fitted) + float(
            self.fitter(fitted.model).part @ fitted.model.log_size
        )


@dataclass(frozen=True, slots=True)
class Round:
    """One round: the hypothesis before, and every single effect added to it.

    Attributes:
        alternatives: Refitted, best first; `criteria` of each, lower is better.
    """

    base: Hypothesis
    alternatives: tuple[Hypothesis, ...]
    criteria: tuple[float, ...]


def penalty(effects: Sequence[Candidate], catalogue: int) -> float:
    """Return what effects must gain to be accepted, the best of so many in a catalogue.

    Of one that has a place, each that it was begun at counts as one more that was tried. Effects of
    tyres pay more: they first make good how the simulator models its tyres.
    """
    total = 0.0
    for effect in effects:
        tried = catalogue * (len(effect.starts) if effect.is_placed else 1)
        tyres = TYRE_MODELS * (effect.equation is Equation.TYRE)
        total += effect.rare + tyres + exceeded(len(effect.parameters), FALSE_ALARMS / tried)
    return total


@cache
def exceeded(degrees: int, chance: float) -> float:
    """Return what chi-squared exceeds with a small chance (Wilson and Hilferty, 1931)."""
    spread = 2.0 / (9.0 * degrees)
    at = NormalDist().inv_cdf(1.0 - chance)
    return degrees * (1.0 - spread + at * math.sqrt(spread)) ** 3


def fit_with_noise(context: Context, fitted: Hypothesis) -> Hypothesis:
    """Return a hypothesis fitted together with its noise, one after the other, twice."""
    for _ in range(context.times_fitted):
        for _ in range(2):
            (fitted,) = with_best_moments(context.fitter(fitted.model), [fitted])
            (fitted,) = context.fitter(fitted.model).refine([fitted], rounds=4, fresh=True)
            residuals, _ = fitted.model.residuals([fitted.numbers])
            fitted = replace(fitted, model=context.fit_noise(fitted.model, residuals, 1))
        fitted = fit_to_the_end(context, fitted, [fitted.z, np.zeros_like(fitted.z)])
    if not has_moments(fitted):
        return fitted
    fitter = context.fitter(fitted.model)
    (moved,) = fitter.refine(with_best_moments(fitter, [fitted]), rounds=2, fresh=True)
    return min((moved, fitted), key=lambda f: f.score)


def fit_to_the_end(context: Context, fitted: Hypothesis, starts: Sequence[Floats]) -> Hypothesis:
    """Return a hypothesis fitted from several values of the car's own numbers, the best one."""
    return fit_all_to_the_end(context, [(fitted, starts)])[0]


def fit_all_to_the_end(
    context: Context, every: Sequence[tuple[Hypothesis, Sequence[Floats]]]
) -> list[Hypothesis]:
    """Return the best of each hypothesis, all fitted together: rollouts are cheap in batches.

    Valleys of the score are long, and some are dead ends: a comparison is fair only between the
    deepest points.
    """
    fitter = context.fitter(every[0][0].model)
    groups = [_from_each(fitted, starts) for fitted, starts in every]
    groups = _refined(fitter, groups, LAST_ROUNDS[0])
    near = [[f for f in group if f.score < min(g.score for g in group) + NEAR] for group in groups]
    return [min(group, key=lambda f: f.score) for group in _refined(fitter, near, LAST_ROUNDS[1])]


def _refined(
    fitter: Fitter, groups: Sequence[Sequence[Hypothesis]], rounds: int
) -> list[list[Hypothesis]]:
    """Return groups of hypotheses refined in one batch."""
    found = iter(fitter.refine([f for g in groups for f in g], rounds=rounds, fresh=True))
    return [[next(found) for _ in group] for group in groups]


def extend(context: Context, base: Hypothesis) -> Round:
    """Return every effect tried beside those of `base`, but none that cancels one of them.

    Where the car's own numbers that came with an effect suit the model without it better than
    those it had, that one is tried again from there: an effect must not earn what a fit missed.
    """
    tried = _extended(context, base)
    if not tried.alternatives:
        return tried
    fitter, others = context.fitter(base.model), [f.z for f in tried.alternatives]
    e, ok = base.model([replace(base, z=z).numbers for z in others])
    costs = np.where(ok, fitter.score(np.nan_to_num(e), np.stack(others)), np.inf)
    best = int(np.argmin(costs))
    if costs[best] > base.score - BETTER_BASE:
        return tried
    return _extended(context, fit_to_the_end(context, base, [others[best]]))


def _extended(context: Context, base: Hypothesis) -> Round:
    fitter = context.fitter(base.model)

    def cost(fitted: Hypothesis) -> float:
        return context.criterion(fitted) - AT_LIMIT * bool(at_limit(fitted.effects[-1], base))

    near, far = _started(context, fitter, base, cost)
    context.notify("refitting " + ", ".join(f.names[-1] for f in near[:4]) + " ...")
    near = fitter.refine(near, rounds=4, race=Race(cost, near=NEAR))
    near += fitter.refine(_steady(fitter, base, near, cost), rounds=4)
    race = Race(cost, min(map(cost, near), default=math.inf), NEAR)
    far = fitter.refine(far, rounds=4, race=race)
    near, far = _lighter(context, near), _lighter(context, far)
    ranked = sorted((_not_worse(f, base) for f in _preferred(near, far)), key=cost)
    if not ranked:
        return Round(base, (), ())
    near = [f for f in ranked if cost(f) < cost(ranked[0]) + NEAR]
    rest = ranked[len(near) :]
    if cost(ranked[0]) < context.criterion(base) + NEAR:
        moved = with_best_moments(fitter, near[:6])
        near, rest = fitter.refine(moved, rounds=3, fresh=True), [*near[6:], *rest]
    ranked = sorted([*near, *rest], key=cost)
    ranked = _lighter(context, _finals(context, ranked, base, cost))
    costs = [cost(f) + let_go(context, f, ranked, base) for f in ranked]
    order = sorted(range(len(ranked)), key=costs.__getitem__)
    return Round(base, tuple(ranked[i] for i in order), tuple(costs[i] for i in order))


def _started(
    context: Context, fitter: Fitter, base: Hypothesis, cost: Callable[[Hypothesis], float]
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """Return the effects that may pay, as linear guesses: from `base`, and from the nominal car.

    A re-tuned car bends towards what is missing, and may hide it; one that lies near its file
    hides nothing.
    """
    amplifies, there = context.amplifies, {*base.names, *(one.like for one in base.effects)}
    trials = [
        ((*base.effects, candidate), np.concatenate((base.values, start)))
        for candidate in context.catalogue
        if candidate.name not in there
        for start in candidate.starts
    ]
    context.notify(f"trying {len(context.catalogue)} effects from {len(trials)} starts")
    spots = SPOTS if amplifies else 1
    begun = fitter.begin(base, trials, amplified=amplifies)
    near = sorted(_best_of_each(begun, spots), key=cost)[:MAX_REFITTED]
    if context.changes:
        changes = changes_to_try(context.penalty, fitter, base, begun)
        changes += varying_to_try(context.penalty, fitter, base, begun)
        near += _best_of_each(fitter.begin(base, changes), 1)
    near = with_best_moments(fitter, _promising(context, base, near))
    near += [f for one in near[:MAX_OTHER_STARTS] for f in next_starts(one, begun)]
    if np.all(np.abs(base.z) <= BENT):
        return near, []
    del begun  # it holds innovations of every start
    begun = fitter.begin(fitter.with_nominal_car(base), trials, amplified=amplifies)
    far = sorted(_best_of_each(begun, spots), key=cost)[:MAX_REFITTED_FROM_NOMINAL]
    return near, _promising(context, base, far)


def _promising(context: Context, base: Hypothesis, fits: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return fits that may pay by what their linear guess gains, and the best few anyhow."""
    best = sorted(fits, key=context.criterion)[:MIN_REFITTED]
    return [
        f for f in fits
        if f in best or base.score - f.score > WORTH_A_FIT * context.penalty(f.effects[-1:])
    ]  # fmt: skip


def _steady(
    fitter: Fitter,
    base: Hypothesis,
    fits: Sequence[Hypothesis],
    cost: Callable[[Hypothesis], float],
) -> list[Hypothesis]:
    """Return the best effects that change or vary as constant ones, begun as they are in the end.

    The constant effect is the simpler one, and may lie beyond where its own starts lead.
    """
    ranked = sorted(fits, key=cost)
    trials = dict[int, Trial]()
    for fitted in ranked[:MIN_REFITTED]:
        effect = fitted.effects[-1]
        if isinstance(effect, ChangingEffect | VaryingEffect):
            count = len(base.values) + len(effect.of.parameters)
            trial = (*base.effects, effect.of), fitted.values[:count]
            trials.setdefault(id(effect.of), trial)
    return fitter.begin(base, list(trials.values()))


def _lighter(context: Context, fits: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return fits without their derivatives, unless these are kept: they fill memory."""
    if context.keeps_derivatives:
        return list(fits)
    return [replace(fitted, jacobian=np.zeros((0, 0))) for fitted in fits]


def _finals(
    context: Context,
    ranked: Sequence[Hypothesis],
    base: Hypothesis,
    cost: Callable[[Hypothesis], float],
) -> list[Hypothesis]:
    """Return fits, the first of them fitted to the end where more than one would be accepted."""
    most = min(context.criterion(base), cost(ranked[0]) + FINALISTS_WITHIN)
    first = [f for f in ranked[:FINALISTS] if cost(f) < most]
    if len(first) > 1:
        context.notify("fitting to the end: " + ", ".join(f.names[-1] for f in first))
        deep = fit_all_to_the_end(context, [(f, [f.z, np.zeros_like(f.z)]) for f in first])
        return [*deep, *ranked[len(first) :]]
    return list(ranked)


def at_limit(effect: Candidate, base: Hypothesis) -> list[int]:
    """Return which of the car's own numbers that an effect means are at their limit.

    A number that the recording pulls as far as its prior allows is most likely the cause.
    """
    keys = {parameter.own or parameter.key for parameter in effect.parameters}
    own = enumerate(zip(base.model.nominal, base.z, strict=True))
    return [j for j, (o, z) in own if o.key in keys and abs(z) > 0.85 * FARTHEST]


def let_go(
    context: Context, fitted: Hypothesis, others: Sequence[Hypothesis], base: Hypothesis
) -> float:
    """Return what does not speak for an effect after all: another may have pulled its number.

    That is so where one that explains the recordings better brings the number back.
    """
    own, mine = at_limit(fitted.effects[-1], base), context.criterion(fitted)
    gone = (context.criterion(f) < mine and np.all(np.abs(f.z[own]) < BACK) for f in others)
    return AT_LIMIT * (bool(own) and any(gone))


def _not_worse(fitted: Hypothesis, base: Hypothesis) -> Hypothesis:
    """Return an effect that found nothing doing nothing: it contains the model without it."""
    if fitted.score <= base.score:
        return fitted
    neutral = np.array([parameter.neutral for parameter in fitted.effects[-1].parameters])
    values = np.concatenate((base.values, neutral))
    return replace(fitted, z=base.z, values=values, innovations=base.innovations, score=base.score)


def _from_each(fitted: Hypothesis, starts: Sequence[Floats]) -> list[Hypothesis]:
    """Return copies of a hypothesis, each at other values of the car's own numbers."""
    unlike = {np.round(z, 3).tobytes(): z for z in starts}
    return [replace(fitted, z=z) for z in unlike.values()]


def _preferred(near: Sequence[Hypothesis], far: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return, of each last effect, the fit that went far only where re-tuning really hid it."""
    best = {id(fitted.effects[-1]): fitted for fitted in sorted(near, key=lambda f: -f.score)}
    for fitted in far:
        other = best.setdefault(id(fitted.effects[-1]), fitted)
        if fitted.score < other.score - NOMINAL_GAIN:
            best[id(fitted.effects[-1])] = fitted
    return list(best.values())


def next_starts(best: Hypothesis, fits: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the best fit of the same one number begun quite elsewhere: valleys may be two."""
    effect, at = best.effects[-1], best.values[-1]
    if len(effect.parameters) != 1:
        return []
    parameter = effect.parameters[0]
    size = abs(at - parameter.neutral)
    far = [
        f for f in fits
        if f.effects[-1] is effect and np.isfinite(f.score) and abs(f.values[-1] - at) > 0.5 * size
    ]  # fmt: skip
    return sorted(far, key=lambda f: f.score)[:1]


def _best_of_each(fits: Sequence[Hypothesis], spots: int) -> list[Hypothesis]:
    """Return the best fit of each last effect, of one that has a place the best at some spots."""
    best = dict[int, list[Hypothesis]]()
    for fitted in sorted(fits, key=lambda f: f.score):
        same = best.setdefault(id(fitted.effects[-1]), [])
        if len(same) < (spots if fitted.effects[-1].is_placed else 1):
            same.append(fitted)
    return [fitted for same in best.values() for fitted in same]
