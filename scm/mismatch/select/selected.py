"""The fit and select steps: the car's own numbers refitted, then the effects that it lacks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from scm.mismatch.budget import Budget, Question
from scm.mismatch.discovery import decide
from scm.mismatch.discovery.decide import Discovery, Offered
from scm.mismatch.discovery.general_effect import learned_terms
from scm.mismatch.effect_catalogue import candidates, placed, shown_by, terms_needed
from scm.mismatch.evidence import Tried
from scm.mismatch.fit.data_split import Parts, split
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.rollouts import Tiles
from scm.mismatch.select.confirm import confirmed, with_placed_moments
from scm.mismatch.select.round import Context, Notify
from scm.mismatch.select.search import (
    TIMES_FITTED_FAR,
    Selection,
    by_windows,
    is_far,
    retune,
    select,
    select_many,
    strays,
)
from scm.recording.read import Recording
from scm.replay.drive import Drive
from scm.vehicles.car import Car

VALIDATION = 1.0  # what follows a selection takes as long as the first fit


@dataclass(frozen=True, slots=True)
class Nominal:
    """Recordings with the car's own numbers refitted, and no effect.

    Attributes:
        car: As given.
        kernel_car: With every effect of the catalogue at rest.
    """

    recordings: Sequence[Recording]
    drives: Sequence[Drive]
    car: Car
    kernel_car: Car
    context: Context
    parts: Parts
    retuned: Hypothesis


@dataclass(frozen=True, slots=True)
class Selected:
    """What a selection ended with, ready to be validated, or to be compared with other cars.

    Attributes:
        recordings, drives: That were usable.
        car: As given.
        context: What it worked with; it says whether the car was judged by windows.
        tried: Effects tried beside the re-tuned car.
        offered, discovery: What a discovered effect was compared with; None where there is none.
        denied: Names of effects that were fitted, and that unseen innovations deny.
        unconfirmed: What was selected with them; None: none was denied.
    """

    recordings: Sequence[Recording]
    drives: Sequence[Drive]
    car: Car
    context: Context
    parts: Parts
    selection: Selection
    tried: tuple[Tried, ...]
    offered: Offered | None = None
    discovery: Discovery | None = None
    denied: tuple[str, ...] = ()
    unconfirmed: Hypothesis | None = None

    @property
    def best(self) -> Hypothesis:
        """The hypothesis that was selected."""
        return self.selection.best

    @property
    def retuned(self) -> Hypothesis:
        """The car with its own numbers refitted alone."""
        return self.selection.retuned


def fit_nominal(
    recordings: Sequence[Recording], car: Car, budget: Budget, notify: Notify
) -> Nominal:
    """Return the car with its own numbers refitted to recordings."""
    known = car.with_terms(terms_needed(car))
    drives = [Drive(recording, known) for recording in recordings]
    have = {term.name for term in known.terms}
    general = [term for term in learned_terms(known) if term.name not in have]
    whole = known.with_terms(general)
    model = Likelihood.of(drives, whole, Tiles(whole, Tiles(known)), budget)
    parts = split(model)
    catalogue = placed(shown_by(candidates(known), drives), drives)
    context = Context(parts.fit.weight + parts.choose.weight, catalogue, notify, budget)
    begun_s = budget.spent_s()
    retuned = retune(context, model)
    budget.reserve(VALIDATION * (budget.spent_s() - begun_s))
    return Nominal(recordings, drives, car, known, context, parts, retuned)


def select_effects(nominal: Nominal) -> Selected:
    """Return the effects that recordings show beside the car's own numbers."""
    selected = _select(nominal)
    context, parts, found = selected.context, selected.parts, selected.selection
    context.notify("judging on what the fit did not see")
    unseen = parts.confirm.weight
    fitted = with_placed_moments(context, found.best, unseen)
    best, denied = confirmed(context, fitted, found.retuned, unseen)
    unconfirmed = fitted if denied else None
    return replace(
        selected, selection=replace(found, best=best), denied=denied, unconfirmed=unconfirmed
    )


def _select(nominal: Nominal) -> Selected:
    context, parts, unseen = nominal.context, nominal.parts, nominal.parts.confirm.weight
    far = is_far(nominal.retuned)
    if far:  # maybe for one large effect, which the re-tuned car takes for disturbances
        context = replace(context, times_fitted=TIMES_FITTED_FAR)
        found = select(
            context, nominal.retuned, lambda found: (strays(found.best.model), None),
            lambda found: bool(found.rounds) and strays(found.best.model),
        )  # fmt: skip
    else:
        found = select(context, nominal.retuned, partial(decide.explain, context, unseen))
    start = Selected(
        nominal.recordings, nominal.drives, nominal.car, context, parts, found,
        tried_of(context, found),
    )  # fmt: skip
    if not (far and strays(found.best.model)):
        offered = decide.offered(context, found, has_unseen=bool(unseen.any()))
        best, discovery = decide.decide(context, found, unseen)
        if not strays(best.model):
            found = replace(found, best=best)
            return replace(start, selection=found, offered=offered, discovery=discovery)
    work = partial(by_windows, context, nominal.drives, nominal.kernel_car)
    many = context.budget.attempt(Question.WINDOWS, work)
    if many is None:  # the first fit is all that is sure
        return replace(start, selection=replace(found, best=found.retuned))
    found = select_many(many.context, many.retuned)
    tried = tried_of(many.context, found)
    return replace(start, context=many.context, parts=many.parts, selection=found, tried=tried)


def tried_of(context: Context, found: Selection) -> tuple[Tried, ...]:
    """Return every effect tried beside the re-tuned car, best first."""
    best: dict[str, Tried] = {}
    for tried in found.rounds[:1]:
        for fitted, criterion in zip(tried.alternatives, tried.criteria, strict=True):
            name = fitted.names[-1]
            needed = context.penalty(fitted.effects)
            one = Tried(name=name, gain=tried.base.score + needed - criterion, needed=needed)
            if name not in best or best[name].gain < one.gain:
                best[name] = one
    return tuple(sorted(best.values(), key=lambda tried: -tried.gain))
