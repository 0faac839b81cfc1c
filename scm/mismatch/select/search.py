"""Selects effects: each round adds the best one, and takes back needless ones.

A car that nobody has measured differs in more ways than one, and its residuals are no noise with
one effect in it. It is judged by residual windows, and each round adds every effect that pays
beside those before it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Question
from scm.mismatch.effect_catalogue import Candidate, candidates
from scm.mismatch.findings import Equation
from scm.mismatch.fit.data_split import Parts, split
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood, Simulator
from scm.mismatch.fit.noise import Noise, doublings, lowered
from scm.mismatch.fit.residual_windows import WindowedLikelihood, fit_sizes
from scm.mismatch.select.confirm import prune, without_each
from scm.mismatch.select.round import Context, Round, extend, fit_with_noise
from scm.replay.drive import Drive, is_led
from scm.vehicles.car import Car

if TYPE_CHECKING:
    from scm.mismatch.discovery.decide import Discovery

MAX_EFFECTS = 4
MAX_LOW_NOISE_TRIALS = 3
DOUBTFUL = 60.0  # gain beyond its penalty below which an effect may be something else
HALF_AT_LIMIT = 4.0  # of `AT_LIMIT`, where an effect is compared not with another but with none
MAX_EFFECTS_BY_WINDOWS, MAX_PER_ROUND = 10, 4
COMPARED_WITHIN = 25.0  # criterion within which the two best effects are compared in full
MARGIN = 10.0  # gain beyond its penalty of each effect beside the first of a round
MANY_DOUBLINGS, FAR_DOUBLINGS = 9.0, 16.0  # of the least noise, summed over its kinds
TIMES_FITTED_FAR = 2


@dataclass(frozen=True, slots=True)
class Selection:
    """What a selection has found so far.

    Attributes:
        best: The hypothesis that explains the recordings best.
        retuned: The car with its own numbers refitted alone.
        rounds: What was tried, round by round.
        discovery: What the dictionary offers, with what it was compared with; None: not computed.
        is_explained: Whether it explains so much that no further effect need be searched for.
    """

    best: Hypothesis
    retuned: Hypothesis
    rounds: tuple[Round, ...] = ()
    discovery: "Discovery | None" = None
    is_explained: bool = False

    def round_of(self, effect: Candidate) -> Round | None:
        """Return the round in which an effect was found."""
        found = (r for r in self.rounds if r.alternatives)
        return next((r for r in found if r.alternatives[0].effects[-1] is effect), None)


def retune(context: Context, model: Likelihood) -> Hypothesis:
    """Return the car with its own numbers refitted alone, under the noise that this leaves."""
    context.notify("fitting the car's own numbers")
    return fit_with_noise(context, context.fitter(model).unfitted())


def select(
    context: Context,
    retuned: Hypothesis,
    explain: Callable[[Selection], "tuple[bool, Discovery | None]"],
    is_over: Callable[[Selection], bool] = lambda _: False,
) -> Selection:
    """Return the hypothesis that explains the recordings best without inventing anything.

    A round that the budget ends halfway counts for nothing.

    Args:
        context: What to work with.
        retuned: To begin from.
        explain: Returns whether something outside the catalogue explains all, and what; it is
            called where the last effect hardly paid its penalty.
        is_over: Whether no further effect is to be searched for.
    """
    found = Selection(retuned, retuned)
    while len(found.best.effects) < MAX_EFFECTS and not is_over(found):
        before, learned = found.best, found.best.noise
        attempt = context.budget.attempt
        tried = attempt(question_beside(before), partial(_one_round, context, found))
        if tried is None:
            break
        found, margin = tried
        first = not before.effects
        if margin < DOUBTFUL and (margin >= 0.0 or first):
            explained = attempt(Question.DISCOVERY, partial(explain, found))
            if explained is not None:
                found = replace(found, is_explained=explained[0], discovery=explained[1])
            if found.is_explained:
                break
        if first and margin < DOUBTFUL:
            work = partial(_under_low_noise, context, found, learned)
            found = attempt(Question.LOW_NOISE, work) or found
        if len(found.best.effects) == len(before.effects):
            break
    return found


def question_beside(best: Hypothesis) -> Question:
    """Return the question that a round beside a hypothesis answers."""
    return Question.FURTHER if best.effects else Question.EFFECTS


def _one_round(context: Context, found: Selection) -> tuple[Selection, float]:
    """Return the selection after one round more, and the margin of its best effect."""
    tried = extend(context, found.best)
    best, margin = tried.base, margin_of(context, tried)
    retuned = found.retuned if found.best.effects else tried.base
    if margin >= 0.0:
        best = prune(context, fit_with_noise(context, tried.alternatives[0]), retuned)
    return replace(found, best=best, retuned=retuned, rounds=(*found.rounds, tried)), margin


def margin_of(context: Context, tried: Round) -> float:
    """Return by how much the best effect of a round gains more than its penalty."""
    if not tried.alternatives:
        return -math.inf
    at_limit = context.criterion(tried.alternatives[0]) - tried.criteria[0]
    return context.criterion(tried.base) - tried.criteria[0] - min(at_limit, HALF_AT_LIMIT)


def _under_low_noise(context: Context, found: Selection, learned: Noise) -> Selection:
    """Return the selection with the best effect that low noise shows, if it is better.

    Noise that was fitted without an effect may have absorbed it. So effects are tried where little
    is put down to disturbances, and compared each under the noise that it leaves: the more of it a
    hypothesis needs, the more it pays.

    Args:
        context: What to work with.
        found: The car with at most one effect.
        learned: The noise model before anything was found.
    """
    context.notify("trying again under low noise")
    low = lowered(learned, found.best.model.drives)
    if low == learned:
        return found
    model = found.best.model.under(low)
    (base,) = context.fitter(model).refine([found.retuned], rounds=4, fresh=True)
    tried, best = extend(context, base), found.best
    for alternative in tried.alternatives[:MAX_LOW_NOISE_TRIALS]:
        if context.criterion(alternative) > context.criterion(tried.base):
            break
        refitted = fit_with_noise(context, alternative)
        if context.cost(refitted) < context.cost(best):
            best = refitted
    if best is found.best:
        return found
    return replace(found, best=best, rounds=(*found.rounds[:-1], tried))


def strays(model: Likelihood) -> bool:
    """Return whether a car differs in so many ways that what its best model leaves is no noise.

    That is so where the least disturbances had to be doubled very often to explain it.
    """
    return doublings(model.noise, model.drives) >= MANY_DOUBLINGS


def is_far(retuned: Hypothesis) -> bool:
    """Return whether a re-tuned car is so far off that one effect at a time would not do."""
    return doublings(retuned.model.noise, retuned.model.drives) >= FAR_DOUBLINGS


@dataclass(frozen=True, slots=True)
class ByWindows:
    """A car judged by residual windows, its own numbers fitted."""

    context: Context
    parts: Parts
    retuned: Hypothesis


def by_windows(context: Context, drives: Sequence[Drive], car: Car) -> ByWindows:
    """Return a car judged by residual windows, and what selects its effects.

    Where the measured speed drives the car, neither drive nor tyres are proposed. No effect is
    begun as strong as suits it best: it would take what belongs to the others.

    Args:
        context: Of the selection of one effect at a time.
        drives: The recordings.
        car: With every effect at rest.
    """
    context.notify("judging by windows: the car differs in many ways")
    catalogue = context.catalogue
    if any(is_led(drive) for drive in drives):
        known = (Equation.STEERING, Equation.SENSOR)
        catalogue = tuple(c for c in catalogue if c.equation in known)
    elif not context.by_windows and (more := candidates(car, beside=True)):
        car, catalogue = car.with_terms([one.name for one in more]), (*catalogue, *more)
    model = WindowedLikelihood(Simulator(drives, car, budget=context.budget))
    parts = split(model)
    mine = replace(
        context, part=parts.fit.weight + parts.choose.weight, catalogue=catalogue,
        fit_noise=fit_sizes, times_fitted=1, amplifies=False, keeps_derivatives=True,
        share_confirmed=0.0, by_windows=True,
    )  # fmt: skip
    return ByWindows(mine, parts, retune(mine, model))


def select_many(
    context: Context, retuned: Hypothesis, start: Hypothesis | None = None
) -> Selection:
    """Return the hypothesis that explains the recordings best, with several effects a round.

    A round that the budget ends before its effects are fitted counts for nothing; later, only what
    it had left to take back.

    Args:
        context: What to work with.
        retuned: The car with its own numbers refitted alone.
        start: To begin from; None: the re-tuned car.
    """
    found = Selection(start or retuned, retuned)
    while len(found.best.effects) < MAX_EFFECTS_BY_WINDOWS:
        question = question_beside(found.best)
        more = context.budget.attempt(question, partial(_round_of_many, context, found))
        if more is None or more is found:
            break
        attempt = partial(context.budget.attempt, Question.FURTHER)
        pruned = attempt(partial(prune, context, more.best, more.retuned))
        more = replace(more, best=pruned or more.best)
        before = set(found.best.names)
        for rare in (e for e in more.best.effects if e.rare and e.name not in before):
            more = attempt(partial(without_rare, context, more, rare)) or more
        if set(more.best.names) <= before:
            break
        found = more
    return found


def _round_of_many(context: Context, found: Selection) -> Selection:
    """Return the selection with all effects that pay, needless ones too; the same if none does."""
    best = found.best
    tried = _beside_each_other(context, _compared(context, extend(context, best)))
    if not tried:
        return found
    more = fit_with_noise(context, _joined(best, [one.alternatives[0] for one in tried]))
    return replace(found, best=more, rounds=(*found.rounds, *tried))


def without_rare(context: Context, found: Selection, rare: Candidate) -> Selection:
    """Return the selection with usual effects in place of a rare one, if these explain more.

    A rare effect may do alone what two usual ones do together: added one by one it comes first,
    and beside it neither of them pays. Compared are hypotheses with the noise that each leaves.
    """
    best = found.best
    if rare not in best.effects:
        return found
    base = without_each(context, best, found.retuned)[best.effects.index(rare)]
    context.notify(f"looking for usual effects in place of {rare.name}")
    usual = replace(context, catalogue=tuple(c for c in context.catalogue if not c.rare))
    tried = _beside_each_other(usual, _compared(usual, extend(usual, base)))
    if not tried:
        return found
    other = _joined(base, [one.alternatives[0] for one in tried])
    other = prune(context, fit_with_noise(context, other), found.retuned)
    if context.cost(other) >= context.cost(best):
        return found
    return replace(found, best=other, rounds=(*found.rounds, *tried))


def _compared(context: Context, tried: Round) -> Round:
    """Return a round whose two best effects, if close, stand as their settled fits do."""
    two = tried.alternatives[:2]
    close = len(two) > 1 and tried.criteria[1] < tried.criteria[0] + COMPARED_WITHIN
    if not close or tried.criteria[1] > context.criterion(tried.base):
        return tried
    costs = list[float]()
    for one in two:
        context.notify(f"comparing {two[0].names[-1]} and {two[1].names[-1]}")
        costs.append(context.cost(fit_with_noise(context, one)))
    if costs[0] <= costs[1]:
        return tried
    return Round(tried.base, (*two[::-1], *tried.alternatives[2:]), tried.criteria)


def _beside_each_other(context: Context, tried: Round) -> list[Round]:
    """Return a round for each effect that pays beside those before it, best first.

    The first was refitted; what another adds to it is a linear guess from its derivatives.
    """
    base = tried.base
    if not tried.alternatives or tried.criteria[0] > context.criterion(base):
        return []
    first = tried.alternatives[0]
    rounds, known = [tried], len(base.z) + len(base.values)
    e, columns = first.innovations, first.jacobian
    while len(rounds) < min(MAX_PER_ROUND, MAX_EFFECTS_BY_WINDOWS - len(base.effects)):
        there = {one.alternatives[0].names[-1] for one in rounds}
        left = [f for f in tried.alternatives if f.names[-1] not in there]
        beside = [np.hstack((columns, f.jacobian[:, known:])) for f in left]
        costs = [
            context.penalty(f.effects[-1:]) - _gain(context, base, e, both)
            for f, both in zip(left, beside, strict=True)
        ]
        order = sorted(range(len(left)), key=costs.__getitem__)
        if not order or costs[order[0]] > -MARGIN:
            break
        columns = beside[order[0]]
        e = e + columns @ _move(context, base, e, columns)
        criteria = tuple(context.criterion(base) + costs[k] for k in order)
        rounds.append(Round(base, tuple(left[k] for k in order), criteria))
    return rounds


def _gain(context: Context, base: Hypothesis, e: Floats, columns: Floats) -> float:
    """Return how much less the loss would be, were everything linear."""
    weights = context.fitter(base.model).weights(e)
    moved = e + columns @ _move(context, base, e, columns)
    return float(weights @ (e * e - moved * moved))


def _move(context: Context, base: Hypothesis, e: Floats, columns: Floats) -> Floats:
    """Return the least-squares move of all numbers; the car's own are held a little."""
    weights = context.fitter(base.model).weights(e)
    rooted = columns * np.sqrt(weights)[:, None]
    prior = np.full(columns.shape[1], 1e-6)
    prior[: len(base.z)] = 1.0
    normal = rooted.T @ rooted + np.diag(prior)
    return np.asarray(-np.linalg.solve(normal, columns.T @ (weights * e)))


def _joined(base: Hypothesis, found: Sequence[Hypothesis]) -> Hypothesis:
    """Return one hypothesis with the last effect of each of several, not refitted yet."""
    first, known = found[0], len(base.values)
    values = np.concatenate((first.values[:known], *(f.values[known:] for f in found)))
    return replace(
        first,
        effects=(*base.effects, *(f.effects[-1] for f in found)),
        values=values,
        jacobian=np.zeros((len(first.innovations), len(base.z) + len(values))),
    )
