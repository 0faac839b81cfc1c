"""Selects effects one at a time: each round adds the best one, and takes back needless ones."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from scm.mismatch.budget import Question
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import Noise, lowered
from scm.mismatch.select.confirm import prune
from scm.mismatch.select.round import Context, Round, extend, fit_with_noise

if TYPE_CHECKING:
    from scm.mismatch.discovery.decide import Discovery

MAX_EFFECTS = 4
MAX_LOW_NOISE_TRIALS = 3
DOUBTFUL = 60.0  # gain beyond its penalty below which an effect may be something else
HALF_AT_LIMIT = 4.0  # of `AT_LIMIT`, where an effect is compared not with another but with none


@dataclass(frozen=True, slots=True)
class Explanation:
    """What else may explain recordings in which effects of the catalogue hardly do.

    Attributes:
        ends: Whether it does so well that no further effect need be searched for.
        discovery: The effect outside the catalogue that does, with those it was compared with.
    """

    ends: bool
    discovery: "Discovery | None" = None


@dataclass(frozen=True, slots=True)
class Selection:
    """What a selection has found so far.

    Attributes:
        best: The hypothesis that explains the recordings best.
        retuned: The car with its own numbers refitted alone.
        rounds: What was tried, round by round.
        explanation: What else may explain the recordings; None: there was no cause to ask.
    """

    best: Hypothesis
    retuned: Hypothesis
    rounds: tuple[Round, ...] = ()
    explanation: Explanation | None = None

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
    explain: Callable[[Selection], Explanation],
    is_over: Callable[[Selection], bool] = lambda _: False,
) -> Selection:
    """Return the hypothesis that explains the recordings best without inventing anything.

    A round that the budget ends halfway counts for nothing.

    Args:
        context: What to work with.
        retuned: To begin from.
        explain: Returns what else may explain the recordings, where the last effect hardly paid
            its penalty.
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
            explanation = attempt(Question.DISCOVERY, partial(explain, found))
            found = replace(found, explanation=explanation or found.explanation)
            if explanation and explanation.ends:
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
    best, margin = tried.base, _margin(context, tried)
    retuned = found.retuned if found.best.effects else tried.base
    if margin >= 0.0:
        best = prune(context, fit_with_noise(context, tried.alternatives[0]), retuned)
    return replace(found, best=best, retuned=retuned, rounds=(*found.rounds, tried)), margin


def _margin(context: Context, tried: Round) -> float:
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
