"""Takes effects back: those that others make needless, and those that unseen data deny."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from scm.arrays import Bools, Floats
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.residual_windows import independent_share
from scm.mismatch.select.changes import has_moments, with_best_moments
from scm.mismatch.select.round import Context, fit_to_the_end

CHANCE_STDS = 4.0  # times the root of what is expected of unseen data: two standard deviations
ENOUGH_UNSEEN = 10.0  # gain where nothing was fitted that is enough for any effect
EQUATION_ERROR = 0.125  # two simulators' equations of the same effect differ by as much
REMAINDER = (
    EQUATION_ERROR**2
)  # share of the largest gain: a smaller one may be its equation's error
COVERED = 0.2  # share of an effect's changes that such an error covers


def without_each(context: Context, fitted: Hypothesis, retuned: Hypothesis) -> list[Hypothesis]:
    """Return refitted hypotheses that lack one effect each, in the effects' order.

    Args:
        context: Of the selection.
        fitted: With one effect at least.
        retuned: The car without effects; where one effect is all, its numbers are tried too.
    """
    if len(fitted.effects) == 1:
        return [refit_without_effects(context, fitted, retuned, fitted.z)]
    fewer, own = list[Hypothesis](), len(fitted.z)
    for i, (_, gone) in enumerate(fitted.each()):
        columns = slice(own + gone.start, own + gone.stop)
        fewer.append(
            Hypothesis(
                fitted.model,
                (*fitted.effects[:i], *fitted.effects[i + 1 :]),
                fitted.z,
                np.delete(fitted.values, gone),
                fitted.innovations,
                fitted.score,
                np.delete(fitted.jacobian, columns, axis=1),
            )
        )
    return context.fitter(fitted.model).refine(fewer, rounds=4, fresh=True)


def refit_without_effects(
    context: Context, fitted: Hypothesis, retuned: Hypothesis, *others: Floats
) -> Hypothesis:
    """Return the car with its own numbers refitted, under the noise model of `fitted`.

    Args:
        context: Of the selection.
        fitted: Whose noise model counts.
        retuned: The car without effects under any noise model, to begin from.
        others: Values of these numbers to begin from as well.
    """
    start = context.fitter(fitted.model).unfitted(retuned.z)
    return fit_to_the_end(context, start, [start.z, *others])


def prune(context: Context, fitted: Hypothesis, retuned: Hypothesis) -> Hypothesis:
    """Return the hypothesis without every effect that the others make needless."""
    while len(fitted.effects) > 1:
        fewer = sorted(without_each(context, fitted, retuned), key=context.criterion)
        if not fewer or context.criterion(fewer[0]) > context.criterion(fitted):
            return fitted
        fitted = fewer[0]
    return fitted


def without_one(
    context: Context,
    fitted: Hypothesis,
    retuned: Hypothesis,
    may_go: Callable[[Candidate], bool] = lambda _: True,
) -> Hypothesis:
    """Return the best hypothesis that lacks one of the effects, fitted to the end.

    It begins from the re-tuned car's own numbers as well: with an effect more than that car it
    explains no less.

    Args:
        context: Of the selection.
        fitted: With one effect at least that may go.
        retuned: The car without effects.
        may_go: Says of which effects one may be lacking.
    """
    each = zip(fitted.effects, without_each(context, fitted, retuned), strict=True)
    best = min((fewer for effect, fewer in each if may_go(effect)), key=context.criterion)
    return fit_to_the_end(context, best, [best.z, retuned.z]) if best.effects else best


def with_placed_moments(context: Context, fitted: Hypothesis, unseen: Floats) -> Hypothesis:
    """Return a hypothesis whose changes are when all parts, the unseen one too, show them best.

    A moment in an unseen block could be anywhere in it, and a change at a wrong one is denied.
    """
    if not has_moments(fitted):
        return fitted
    (moved,) = with_best_moments(Fitter(fitted.model, context.part + unseen), [fitted])
    return replace(context.fitter(fitted.model).at(moved), covariance=fitted.covariance)


def confirmed(
    context: Context, best: Hypothesis, retuned: Hypothesis, unseen: Floats
) -> tuple[Hypothesis, tuple[str, ...]]:
    """Return the hypothesis without effects that do not help on unseen data, and their names.

    Of what an effect gains where it was fitted, a share must come out there too, by length, or
    `ENOUGH_UNSEEN`; of one that pays its penalty and hardly acts there, no more than it can show.
    One that gains next to nothing beside another, and where that one acts, is what its equation
    leaves. By windows, one that the rest makes needless goes too, and intervals are wider for what
    windows share.
    """
    denied = list[str]()
    while best.effects:
        others = without_each(context, best, retuned)
        excess = _unseen_gains(context, best, others, Fitter(best.model, unseen))
        if excess.min() > 0.0:
            break
        worst = int(np.argmin(excess))
        denied.append(best.names[worst])
        best = others[worst]
    if context.by_windows:
        best = prune(context, best, retuned)
        share = independent_share(best.model, best.innovations)
        best = replace(best, covariance=best.covariance / share)
    return best, tuple(denied)


def _unseen_gains(
    context: Context, best: Hypothesis, others: Sequence[Hypothesis], fitter: Fitter
) -> Floats:
    """Return by how much each effect gains more on the unseen part than it must."""
    share = float(fitter.part.sum()) / max(context.events, 1)
    e = best.innovations
    own = float(fitter.prior_loss(best.z)[0])
    at_best = fitter.score(e[:, None], best.z)[0] - own
    gains = np.array([max(f.score - best.score, 0.0) for f in others])
    losses = [fitter.score(f.innovations[:, None], f.z) - fitter.prior_loss(f.z) for f in others]
    unseen = np.concatenate(losses) - at_best
    shown = np.array([float(fitter.weights(e) @ (f.innovations - e) ** 2) for f in others])
    pays = gains > [context.penalty((effect,)) for effect in best.effects]
    least = np.where(pays, shown - CHANCE_STDS * np.sqrt(shown), np.inf)
    required = context.share_confirmed * np.minimum(share * gains, least)
    unseen -= np.minimum(np.minimum(required, least), ENOUGH_UNSEEN)
    unseen[_remainders(context, best, others, gains)] = -np.inf
    return np.asarray(unseen)


def _remainders(
    context: Context, best: Hypothesis, others: Sequence[Hypothesis], gains: Floats
) -> Bools:
    """Return which effects are no more than an error in the equation of the largest.

    Args:
        context: Of the selection.
        best: With all effects; `others`: without each.
        others: In the effects' order.
        gains: Of each effect.
    """
    e, part = best.innovations, context.fitter(best.model).part
    most = int(np.argmax(gains))
    large = (EQUATION_ERROR * (others[most].innovations - e)) ** 2
    small = gains < REMAINDER * gains[most]
    for i in np.flatnonzero(small).tolist():
        mine = (others[i].innovations - e) ** 2
        small[i] = part @ np.minimum(mine, large) > COVERED * float(part @ mine)
    return np.asarray(small)
