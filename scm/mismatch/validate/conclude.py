"""The validate step: what was selected, judged by free runs, located and put into words."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from scm.arrays import Floats
from scm.errors import RecordingError, ScmError
from scm.mismatch.discovery.decide import is_discovered
from scm.mismatch.effect_catalogue import Candidate
from scm.mismatch.evidence import Curve, Evidence, FreeRuns
from scm.mismatch.experiment.suggest import Suggestion
from scm.mismatch.findings import (
    Diagnosis,
    Dropped,
    Effect,
    Equation,
    Failure,
    Fit,
    Undecided,
    Verdict,
)
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.report.wording import capital, title_of
from scm.mismatch.select.begin_again import from_witness, with_wider_numbers
from scm.mismatch.select.confirm import without_one
from scm.mismatch.select.round import Context, Notify
from scm.mismatch.select.selected import Selected
from scm.mismatch.usable_data import titles_of
from scm.mismatch.validate.curves import curve, discovered_curves
from scm.mismatch.validate.explain import (
    effect_of,
    includes_none,
    refitted,
    undecided_of,
    widened_of,
)
from scm.mismatch.validate.found_car import CarFiles, as_written, on
from scm.mismatch.validate.free_runs import drives_alike, judge, stated_by, strays
from scm.mismatch.validate.locate import locate, since_changes, strayed
from scm.mismatch.validate.never_worse import (
    GIVEN,
    LIKE_OTHER_EQUATIONS,
    NEARER,
    POSE,
    RETUNED,
    denied,
    dropped,
    failure_sentence,
    is_behind,
    is_nearer,
    loses,
    reasons_of,
    unwritten,
    useless,
    worse_than,
)
from scm.mismatch.validate.residuals import on_one_axis
from scm.mismatch.validate.stages import Stage, shares_at
from scm.mismatch.validate.witness import witness_of
from scm.vehicles.car import Car

FAR_NEARER = 0.7  # of the error without effects that innovations deny, or that may be nothing


@dataclass(frozen=True, slots=True)
class Result:
    """A diagnosis with what its report needs.

    Attributes:
        car: As given.
        best: What was selected; `retuned`: the car's own numbers refitted alone. None where the
            recordings cannot be used.
        suggestions: Drives that would answer what this one cannot.
        selected: What it concludes from; None where nothing could be selected.
        found_car, retuned_car: As their written files say; None where none could be written.
        files: Keeps the folder of those files.
        account: Which rows were read, a line a recording.
        stages: The car as it was in each part of a recording, the one found last.
    """

    diagnosis: Diagnosis
    car: Car
    evidence: Evidence
    best: Hypothesis | None = None
    retuned: Hypothesis | None = None
    suggestions: tuple[Suggestion, ...] = ()
    selected: Selected | None = None
    found_car: Car | None = None
    retuned_car: Car | None = None
    files: CarFiles | None = None
    account: tuple[str, ...] = ()
    stages: tuple[Stage, ...] = ()


@dataclass(frozen=True, slots=True)
class _Validated:
    """A hypothesis with its effects, its car, and free runs of the given car and of this one."""

    best: Hypothesis
    effects: tuple[Effect, ...]
    car: Car | None
    fit: Fit | None
    free_runs: FreeRuns | None
    stages: tuple[Stage, ...]
    dropped: tuple[Dropped, ...] = ()
    failure: Failure | None = None


_Judged = tuple[Selected, Car | None, _Validated]
"""A selection, its re-tuned car, and what stays of it."""


def conclude(selected: Selected, notify: Notify) -> Result:
    """Return the diagnosis of what was selected, validated, located and put into words."""
    car, titles = selected.car, titles_of(selected.recordings)
    files = CarFiles(car, titles)
    selected, retuned_car, valid = _nearest(selected, files, notify)
    valid = _handed_out(selected, files, valid)
    retuned, best, effects, fit = selected.retuned, valid.best, valid.effects, valid.fit
    if fit is not None and valid.free_runs is not None:
        fit = structs.replace(fit, stated=stated_by(car, valid.free_runs))
    located, residuals = locate(retuned, best)
    end_s = float(selected.drives[-1].edges[-1])
    located = since_changes(located, effects, end_s, _pauses(selected))
    suggestions = () if selected.context.by_windows else undecided_of(selected, best, notify)
    undecided = tuple(suggestion.undecided for suggestion in suggestions)
    verdict = Verdict.MISMATCH
    if not valid.failure:
        verdict = verdict_of(effects, undecided, fit, valid.free_runs)
    if verdict is Verdict.MISMATCH and not effects and fit and valid.free_runs:
        located = strayed(valid.free_runs, fit)
    diagnosis = Diagnosis(verdict=verdict, located=located, effects=effects, undecided=undecided,
                          fit=fit, runtime_s=0.0, dropped=valid.dropped, failure=valid.failure,
                          unanswered=selected.context.budget.unanswered)  # fmt: skip
    evidence = Evidence(
        vehicle=car.name, recordings=titles, residuals=residuals, free_runs=valid.free_runs,
        refitted=as_written(refitted(best, car), valid.car or car), tried=selected.tried,
        curves=_curves(selected, best), pauses=_pauses(selected),
        retuned_m=fit.retuned.get(POSE[0]) if fit and fit.retuned else None,
        widened=widened_of(best.model, car),
    )  # fmt: skip
    return Result(
        diagnosis, car, evidence, best, retuned, suggestions, selected, valid.car, retuned_car,
        files, stages=valid.stages,
    )  # fmt: skip


def _nearest(selected: Selected, files: CarFiles, notify: Notify) -> _Judged:
    """Return a selection with its re-tuned car and what stays of it.

    Where numbers ended at an end of their scatter, or the witness follows better, the search begins
    again, and what is nearer on the part that chooses is taken.
    """
    first = _with_its_cars(selected, files)
    if selected.unconfirmed is not None:
        first = _confirmed_by_driving(selected, selected.unconfirmed, files, first)
    wider = with_wider_numbers(selected)
    if wider is not None:
        notify("judging with wider numbers")
        first = min((first, _with_its_cars(wider, files)), key=lambda one: _chosen_m(one[2].fit))
    selected, fit = first[0], first[2].fit
    if fit is None or fit.witness is None or not is_behind(fit):
        return first
    again = from_witness(selected, fit.witness.numbers)
    if again is None:
        return first
    notify("judging what began from the bicycle")
    other = _with_its_cars(again, files)
    return min((first, other), key=lambda one: _chosen_m(one[2].fit))


def _confirmed_by_driving(
    selected: Selected, unconfirmed: Hypothesis, files: CarFiles, without: _Judged
) -> _Judged:
    """Return a selection with the effects that innovations deny, where the car drives far nearer.

    A slow force is little in innovations, for disturbances may be as slow, and much in free runs.
    """
    selection = replace(selected.selection, best=unconfirmed)
    restored = replace(selected, selection=selection, denied=(), unconfirmed=None)
    other = _with_its_cars(restored, files)
    fit = other[2].fit
    if fit is None or fit.retuned is None or not other[2].best.effects:
        return without
    name = POSE[0]
    near = fit.confirm.after[name] < FAR_NEARER * min(fit.retuned[name], fit.confirm.before[name])
    return other if near else without


def _with_its_cars(selected: Selected, files: CarFiles) -> _Judged:
    _, retuned_car = _written(selected, files, selected.retuned)
    return selected, retuned_car, _validated(selected, files, retuned_car)


def _chosen_m(fit: Fit | None) -> float:
    """Return the position error on the part that chooses."""
    return math.inf if fit is None else fit.choose.after.get(POSE[0], math.inf)


def _validated(selected: Selected, files: CarFiles, retuned_car: Car | None) -> _Validated:
    """Return what stays of a hypothesis after free runs on unseen parts, beside the witness.

    Effects go until the car does nothing worse than those without. Errors of sensors stay first,
    and what went, with the re-tuned or the given car: where a car moves worse, its own numbers may
    be why. With the given one they stay where it drives as given: then the re-tuned car is nearer
    in one way and farther in another, and no numbers are better than both.
    """
    best, context, given = selected.best, selected.context, selected.best.model.car
    gone = denied(selected.denied)
    others = [best.model.simulator.unfitted(), selected.retuned.z]
    while True:
        effects, car = _written(selected, files, best)
        stages = _stages(files, best, effects, car)
        if not stages and effects:
            best, lost = _with_fewer(selected, best)
            gone += unwritten(lost)
            continue
        fit, free_runs = _judged(selected, given, stages)
        if fit is None or free_runs is None:
            return _Validated(best, effects, car, fit, free_runs, stages, tuple(gone))
        beside = _judged(selected, retuned_car, stages)[0] if effects else None
        worse = worse_than(fit, beside) if effects else None
        if worse is None:
            fewer = _as_near_without(selected, files, best, effects, stages, beside)
            if fewer is None:
                break
            best, less = fewer
            gone += less
            continue
        if moves_nothing_at_end(best):
            if others:
                best = with_numbers(context, best, others.pop())
                continue
            if drives_alike(fit):
                break
        best, lost = _with_fewer(selected, best)
        gone += dropped(lost, worse, fit.horizon_s)
    own = None if beside is None else beside.confirm.before
    fit = structs.replace(
        fit, retuned=own, witness=witness_of(selected.drives, selected.car, free_runs)
    )
    return _Validated(best, effects, car, fit, free_runs, stages, tuple(gone))


def _with_fewer(
    selected: Selected, best: Hypothesis, may_go: Callable[[Candidate], bool] = lambda _: True
) -> tuple[Hypothesis, list[str]]:
    """Return a hypothesis without its weakest effect that may go, and that effect's name."""
    fewer = selected.retuned
    if len(best.effects) > 1:
        fewer = without_one(selected.context, best, selected.retuned, may_go)
    return fewer, [name for name in best.names if name not in fewer.names]


def _as_near_without(
    selected: Selected,
    files: CarFiles,
    best: Hypothesis,
    effects: Sequence[Effect],
    stages: Sequence[Stage],
    beside: Fit | None,
) -> tuple[Hypothesis, list[Dropped]] | None:
    """Return a hypothesis without its weakest effect that need not be there.

    If it brings the car hardly nearer. One need not be there that two simulators of one car may
    differ by: other equations of the same parts change what sensors feel by more than noise, and
    hardly where the car goes. Judged by residual windows, it is one whose intervals include none;
    the car must be far nearer with it.

    Args:
        selected: What was selected.
        files: To write its car with.
        best: With effects.
        effects: What is stated of them.
        stages: Of its car.
        beside: Of the re-tuned car and this one.
    """
    may_go, share = _may_be_an_equation, NEARER
    if selected.context.by_windows:
        each = zip(best.effects, effects, strict=True)
        unsure = {one.name for one, stated in each if includes_none(one, stated)}
        share = FAR_NEARER

        def may_go(effect: Candidate) -> bool:
            return effect.name in unsure

    if not any(map(may_go, best.effects)):
        return None
    fewer, lost = _with_fewer(selected, best, may_go)
    if fewer.effects:
        beside = _judged(selected, _written(selected, files, fewer)[1], stages)[0]
    if beside is None or is_nearer(beside, share):
        return None
    return fewer, useless(lost, beside)


def _may_be_an_equation(effect: Candidate) -> bool:
    """Return whether an effect may stand for another equation of the same healthy part."""
    if effect.equation is Equation.SENSOR:
        return False
    of_part = effect.equation is Equation.TYRE or effect.name in LIKE_OTHER_EQUATIONS
    return of_part or is_discovered(effect)


def _handed_out(selected: Selected, files: CarFiles, valid: _Validated) -> _Validated:
    """Return the car that is handed out: not the one found where the witness follows better.

    A car without effects keeps the numbers of its file where refitted ones bring it no nearer.
    """
    best, fit = valid.best, valid.fit
    if fit is None:
        return valid
    now, failed = valid, bool(best.effects) and loses(fit)
    if failed:
        effects, car = _written(selected, files, selected.retuned)
        now = _again(selected, replace(now, best=selected.retuned, effects=effects, car=car))
    as_refitted = not (now.fit and gained_nothing(now.fit))
    if not now.best.effects and not as_refitted:
        given = as_given(selected.context, now.best)
        now = _again(selected, replace(now, best=given, car=selected.car))
    shown = valid if failed else now
    if shown.fit is None or shown.free_runs is None or not loses(shown.fit):
        return now
    text = failure_sentence(shown.fit, best.names, RETUNED if as_refitted else GIVEN)
    reasons = reasons_of(best, selected.car, shown.fit, shown.free_runs)
    failure = Failure(text=text, reasons=reasons)
    lost = [Dropped(name=name, text=f"{capital(title_of(name))} is part of a fit that failed.")
            for name in best.names]  # fmt: skip
    return replace(now, dropped=(*now.dropped, *lost), failure=failure)


def _again(selected: Selected, valid: _Validated) -> _Validated:
    """Return another car with its own free runs, beside the same witness."""
    stages = () if valid.car is None else (Stage(valid.car),)
    fit, free_runs = _judged(selected, selected.best.model.car, stages)
    if fit is not None and valid.fit is not None:
        fit = structs.replace(fit, witness=valid.fit.witness)
    return replace(valid, fit=fit, free_runs=free_runs, stages=stages)


def _written(
    selected: Selected, files: CarFiles, fitted: Hypothesis
) -> tuple[tuple[Effect, ...], Car | None]:
    """Return a hypothesis' effects, and its car as the written file says; None if none loads."""
    effects = tuple(effect_of(selected, fitted, effect) for effect in fitted.effects)
    try:
        return effects, files.written(fitted, effects)
    except ScmError:
        return effects, None


def _stages(
    files: CarFiles, fitted: Hypothesis, effects: Sequence[Effect], car: Car | None
) -> tuple[Stage, ...]:
    """Return the car in each part of the recording; empty if one of them loads from no file."""
    try:
        return () if car is None else files.stages(fitted, effects, car)
    except ScmError:
        return ()


def _judged(
    selected: Selected, before: Car | None, after: Car | Sequence[Stage] | None
) -> tuple[Fit | None, FreeRuns | None]:
    """Return free runs of two cars; nothing where no part has a whole window, or a car no file."""
    if before is None or not after:
        return None, None
    base = selected.best.model.car
    stages = (Stage(after),) if isinstance(after, Car) else after
    stages = [replace(stage, car=on(base, stage.car)) for stage in stages]
    try:
        return judge(selected.drives, on(base, before), stages, selected.parts)
    except RecordingError:
        return None, None


def gained_nothing(fit: Fit) -> bool:
    """Return whether the car's own numbers, refitted, bring it no nearer on unseen parts."""
    before, after = fit.confirm.before, fit.confirm.after
    return POSE[0] in before and after[POSE[0]] >= before[POSE[0]]


def moves_nothing_at_end(fitted: Hypothesis) -> bool:
    """Return whether the car at the end moves the same without the effects.

    They are errors of sensors, or went: windows may have none of them.
    """
    of_car, at_end = fitted.model.simulator.tiles.columns, shares_at(fitted, math.inf)
    return all(
        not share
        or (
            effect.equation is Equation.SENSOR
            and not any(p.key in of_car for p in effect.parameters)
        )
        for effect, share in zip(fitted.effects, at_end, strict=True)
    )


def with_numbers(context: Context, best: Hypothesis, z: Floats) -> Hypothesis:
    """Return a hypothesis with other own numbers of the car."""
    fitter = context.fitter(best.model)
    return replace(fitter.at(replace(best, z=z)), covariance=best.covariance)


def as_given(context: Context, best: Hypothesis) -> Hypothesis:
    """Return the car with its own numbers as its file gives them, as sure as the file is."""
    given = replace(best, z=best.model.simulator.unfitted())
    fitter = context.fitter(best.model)
    return replace(fitter.at(given), covariance=np.eye(len(best.z)))


def verdict_of(
    effects: Sequence[Effect],
    undecided: Sequence[Undecided],
    fit: Fit | None,
    free_runs: FreeRuns | None,
) -> Verdict:
    """Return the verdict; a car that strays for no cause that was tried is a mismatch too."""
    if undecided:
        return Verdict.UNDECIDED
    differs = fit is not None and free_runs is not None and strays(fit, free_runs)
    return Verdict.MISMATCH if effects or differs else Verdict.NONE


def _curves(selected: Selected, best: Hypothesis) -> tuple[Curve, ...]:
    """Return the effects found as curves; a discovered one with its bins beside it."""
    drawn = [curve(best, e) for e in best.effects if not is_discovered(e)]
    discovery = selected.discovery
    more = () if discovery is None else discovered_curves(best, discovery.tried)
    return (*(c for c in drawn if c is not None), *more)


def _pauses(selected: Selected) -> tuple[tuple[float, float], ...]:
    """Return what `Evidence.pauses` holds; nothing of several recordings, or of a whole one."""
    recordings, drives = selected.recordings, selected.drives
    if len(drives) == 1 or len({(r.path, r.name) for r in recordings}) > 1:
        return ()
    moves = on_one_axis(drives)
    return tuple((float(d.edges[0]) + move, -move) for d, move in zip(drives, moves, strict=True))
