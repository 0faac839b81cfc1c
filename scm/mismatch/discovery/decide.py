"""Whether an effect outside the catalogue replaces what the catalogue offers.

One alone is compared with the best hypothesis of the catalogue, each under the noise that it
leaves: it must be better by its penalty and a margin, and explain unseen data better too.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from scm.arrays import Floats
from scm.mismatch.budget import Question
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect
from scm.mismatch.discovery.sensor_effects import SensorEffect
from scm.mismatch.discovery.try_dictionary import DictionaryFits, criterion, try_dictionary
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.findings import Alternative
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.noise import lowered
from scm.mismatch.select.round import Context, extend, fit_with_noise
from scm.mismatch.select.search import Selection
from scm.mismatch.varying_effect import VaryingEffect

MARGIN = 10.0  # criterion; what is hardly better than a known effect is that effect
MAX_BESIDE, MAX_FITTED = 2, 2
HOPELESS = 50.0  # score that no noise model makes up for
BY_FAR = 300.0  # cost that one more known effect that hardly pays never makes up for
MAX_KNOWN_SHOWN, MAX_DISCOVERED_SHOWN = 4, 2  # alternatives in a report
TIE = 6.0  # difference of two criteria that proves nothing


def is_discovered(effect: object) -> bool:
    """Return whether an effect is outside the catalogue."""
    return isinstance(effect, DictionaryEffect | SensorEffect | VaryingEffect)


@dataclass(frozen=True, slots=True)
class Compared:
    """A hypothesis, and what it and the noise that it leaves cost together.

    Attributes:
        unseen: Loss on the part that no fit has seen.
    """

    fitted: Hypothesis
    cost: float
    unseen: float


@dataclass(frozen=True, slots=True)
class Discovery:
    """What the dictionary offers beside the car without effects.

    Attributes:
        beside: The hypothesis of the catalogue that it was compared with.
        best: The best effect of the dictionary, settled; None where none was near.
        tried: All that were tried.
    """

    beside: Hypothesis
    best: Compared | None
    tried: DictionaryFits


@dataclass(frozen=True, slots=True)
class Offered:
    """What the catalogue offered before a discovered effect took its place.

    Attributes:
        name: Of the best hypothesis, `grade and wind`; empty where no effect paid its penalty.
        cost: Of that hypothesis, with the noise that it leaves; lower is better.
        behind: By how much other effects, each alone, cost more than that hypothesis, by name.
        has_unseen: Whether there was unseen data, on which a discovered effect must be better too.
    """

    name: str
    cost: float
    behind: Mapping[str, float]
    has_unseen: bool


def explain(context: Context, unseen: Floats, found: Selection) -> tuple[bool, Discovery | None]:
    """Return whether a discovered effect leaves nothing that known effects could explain, and it.

    Then no further ones need be searched for: it is better than the best hypothesis by far, on
    unseen data too, and no known effect beside it pays its penalty. It is computed once.

    Args:
        context: Of the selection.
        unseen: Weight of each innovation that no fit has seen, (events,); may be all zero.
        found: So far.
    """
    if found.discovery is not None:
        return False, found.discovery
    known = _compared(context, found.best, unseen)
    discovery = discover(context, found, unseen)
    best, ends = discovery.best, False
    if best and _is_better(best, known, unseen, BY_FAR):
        known = _from_low_noise(context, known, unseen)
        ends = _is_better(best, known, unseen, BY_FAR) and not _one_beside(context, best.fitted)
    return ends, discovery


def decide(
    context: Context, found: Selection, unseen: Floats
) -> tuple[Hypothesis, Discovery | None]:
    """Return the better of the best hypothesis and a discovered effect, known effects beside it.

    Where the budget ends before the two could be compared, it is the one of the catalogue.

    Args:
        context: Of the selection.
        found: By it.
        unseen: As in `explain`.
    """
    if found.is_explained and found.discovery and found.discovery.best:
        return found.discovery.best.fitted, found.discovery
    work = partial(_decided, context, found, unseen)
    decided = context.budget.attempt(Question.DISCOVERY, work)
    if decided is None:
        return found.best, None
    better, discovery = decided
    if discovery is None:
        return better.fitted, None
    return _with_known(context, better, unseen), discovery


def _decided(
    context: Context, found: Selection, unseen: Floats
) -> tuple[Compared, Discovery | None]:
    """Return the better hypothesis, and what was discovered if it is that."""
    discovery = found.discovery
    if discovery is None or discovery.beside is not found.best:
        discovery = discover(context, found, unseen)
    best = discovery.best
    if best is None:
        return _compared(context, found.best, unseen), None
    again = fit_with_noise(context, found.best)  # as often as the discovered one
    known = _compared(context, again, unseen)
    if _is_better(best, known, unseen, MARGIN):
        known = _from_low_noise(context, known, unseen)
    if _is_better(best, known, unseen, MARGIN):
        return best, discovery
    return known, None


def _from_low_noise(context: Context, known: Compared, unseen: Floats) -> Compared:
    """Return a hypothesis with its noise fitted from as low a start as a discovered effect's.

    Noise that was fitted without an effect may have absorbed it, and stay there.
    """
    fitted = known.fitted
    low = fitted.model.under(lowered(fitted.noise, fitted.model.drives))
    (begun,) = context.fitter(low).refine([fitted], rounds=3, fresh=True)
    other = _compared(context, fit_with_noise(context, begun), unseen)
    return min(known, other, key=lambda one: one.cost)


def discover(context: Context, found: Selection, unseen: Floats) -> Discovery:
    """Return the best effect of the dictionary beside the car without effects, under low noise."""
    known = found.best
    low = known.model.under(lowered(known.noise, known.model.drives))
    fitter = context.fitter(low)
    (bare,) = fitter.refine([fitter.unfitted(known.z)], rounds=3, fresh=True)
    tried = try_dictionary(bare, fitter.part, context.notify)
    e, _ = low([known.numbers])
    least = min([float(fitter.score(e, known.z)[0]), *(f.score for f in tried.found[:1])])
    near = [f for f in tried.found[:MAX_FITTED] if f.score < least + HOPELESS]
    refitted = [_compared(context, fit_with_noise(context, fitted), unseen) for fitted in near]
    return Discovery(known, min(refitted, key=lambda one: one.cost, default=None), tried)


def _is_better(discovered: Compared, known: Compared, unseen: Floats, margin: float) -> bool:
    """Return whether a discovered effect costs less by a margin, and on unseen data no more."""
    is_worse = bool(unseen.any()) and discovered.unseen > known.unseen
    return discovered.cost <= known.cost - margin and not is_worse


def _with_known(context: Context, discovered: Compared, unseen: Floats) -> Hypothesis:
    """Return a discovered effect with the known effects that it leaves to be found."""
    for _ in range(MAX_BESIDE):
        work = partial(_with_one, context, discovered, unseen)
        more = context.budget.attempt(Question.BESIDE, work)
        if more is None or more is discovered:
            break
        discovered = more
    return discovered.fitted


def _with_one(context: Context, discovered: Compared, unseen: Floats) -> Compared:
    """Return a discovered effect with the best known one beside it; the same where none pays."""
    beside = _one_beside(context, discovered.fitted)
    if beside is None:
        return discovered
    more = _compared(context, fit_with_noise(context, beside), unseen)
    return discovered if more.cost > discovered.cost else more


def _one_beside(context: Context, fitted: Hypothesis) -> Hypothesis | None:
    """Return the best known effect beside a hypothesis; None where none pays its penalty."""
    best = next(iter(extend(context, fitted).alternatives), None)
    return (
        None
        if best is None or criterion_of(context, best) > criterion_of(context, fitted)
        else best
    )


def criterion_of(context: Context, fitted: Hypothesis) -> float:
    """Return a hypothesis' score and what its effects must gain, in a selection."""
    return criterion(fitted, context.events, len(context.catalogue))


def _cost(context: Context, fitted: Hypothesis) -> float:
    """Return what a hypothesis and the noise that it leaves cost together."""
    sizes = float(context.fitter(fitted.model).part @ fitted.model.log_size)
    return criterion_of(context, fitted) + sizes


def _compared(context: Context, fitted: Hypothesis, unseen: Floats) -> Compared:
    """Return a hypothesis under the noise that it leaves: whoever needs more noise pays for it."""
    loss = Fitter(fitted.model, unseen).score(fitted.innovations[:, None], np.zeros_like(fitted.z))
    sizes = float(unseen @ fitted.model.log_size)
    return Compared(fitted, _cost(context, fitted), float(loss[0]) + sizes)


def offered(context: Context, found: Selection, *, has_unseen: bool) -> Offered:
    """Return what the catalogue offers, under the noise that its best hypothesis leaves."""
    known, behind = found.best, dict[str, float]()
    for tried in found.rounds[:1]:
        best = tried.criteria[0] if known.effects else context.criterion(tried.base)
        for fitted, cost in zip(tried.alternatives, tried.criteria, strict=True):
            name = fitted.names[-1]
            if name not in known.names:
                behind[name] = min(max(cost - best, 0.0), behind.get(name, math.inf))
    return Offered(" and ".join(known.names), _cost(context, known), behind, has_unseen)


def alternatives_to(
    context: Context, best: Hypothesis, effect: Candidate, known: Offered, discovery: Discovery
) -> tuple[float, tuple[Alternative, ...]]:
    """Return a discovered effect's probability among its alternatives, and the next ones."""
    worse = known.cost - _cost(context, best)
    others = sorted(known.behind.items(), key=lambda one: one[1])[:MAX_KNOWN_SHOWN]
    rows = [(name, worse + more) for name, more in others]
    if known.name:
        rows = [(known.name, worse), *rows[: MAX_KNOWN_SHOWN - 1]]
    tried = sorted([*rows, *_others_discovered(effect, discovery.tried)], key=lambda one: one[1])
    weights = [math.exp(-0.5 * min(max(w, 0.0), 1400.0)) for _, w in tried]
    total = 1.0 + sum(weights)
    return 1.0 / total, tuple(
        Alternative(name=name, probability=weight / total,
                    ruled_out_by=against(w, unseen=known.has_unseen and name == known.name))
        for (name, w), weight in zip(tried, weights, strict=True)
    )  # fmt: skip


def against(worse: float, *, unseen: bool = False) -> str:
    """Return what rules an alternative out that costs so much more [squared std].

    Args:
        worse: Than what was found.
        unseen: Whether it explains a part that no fit has seen worse as well.
    """
    if worse < TIE:
        return "nothing in this recording"
    text = f"the recording: it explains it worse by {math.sqrt(worse):.1f} standard deviations"
    return f"{text}, and parts that no fit has seen worse too" if unseen else text


def _others_discovered(effect: Candidate, tried: DictionaryFits) -> Sequence[tuple[str, float]]:
    """Return other effects of the dictionary, and how much more each costs; the best of a name."""
    every = [(f.effects[-1], c) for f, c in zip(tried.found, tried.criteria, strict=True)]
    mine = next((c for one, c in every if one is effect), math.inf)
    found = dict[str, float]()
    for one, c in every:
        if one.name != effect.name and c > mine:
            found.setdefault(one.name, c - mine)
    return list(found.items())[:MAX_DISCOVERED_SHOWN]
