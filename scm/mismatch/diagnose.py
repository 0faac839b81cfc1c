"""A whole diagnosis: read, doubt, fit, search, judge, say."""

import math
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from msgspec import structs
from threadpoolctl import threadpool_limits

from scm.clock import Clock, WallClock
from scm.data_quality.pose_track import clean, recorded_s
from scm.data_quality.prepare import Prepared, prepare
from scm.data_quality.problem import DataProblem
from scm.data_quality.quality import Quality
from scm.errors import RecordingError, ScmError
from scm.mismatch.budget import DEFAULT_S, Budget, Question
from scm.mismatch.discovery.curves import discovered_curves
from scm.mismatch.discovery.decide import Lawful, is_discovered
from scm.mismatch.discovery.seek import Sought, with_general_effect
from scm.mismatch.effect_catalogue import Candidate, candidates, placed, shown_by, terms_needed
from scm.mismatch.evidence import Curve, Evidence, FreeRuns, Tried
from scm.mismatch.experiment.scenario import write_scenario
from scm.mismatch.experiment.suggest import Suggestion
from scm.mismatch.findings import Diagnosis, Effect, Fit, Unanswered, Undecided, Verdict, folders_of
from scm.mismatch.fit.data_split import Parts, split
from scm.mismatch.fit.fitter import Fitted, Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.sample import sampled
from scm.mismatch.report.write import write_report
from scm.mismatch.select.alternatives import Standing, standing
from scm.mismatch.select.many_effects import SETTLES_FAR, by_windows, is_far, strays
from scm.mismatch.select.search import Search
from scm.mismatch.validate.curves import curve
from scm.mismatch.validate.explain import effect_of, ordinary_of, tried_of, undecided_of, widened_of
from scm.mismatch.validate.found_car import CarFiles, as_written, on
from scm.mismatch.validate.free_runs import judge, nothing_got_worse
from scm.mismatch.validate.locate import locate
from scm.mismatch.validate.residual_forces import on_one_axis
from scm.mismatch.validate.strayed import strayed
from scm.recorder.drives import SUFFIX, recordings_of_one
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.replay.drive import Drive
from scm.vehicles.car import Car, load_car

POSE = ("position_m", "yaw_rad")
RETUNED = "retuned.toml"
POSE_X, SHORTEST_S = "pose.x", 20.0  # of several recordings together, where each is short
OF_SHORT = ("no_verdict", "too_short")
TAIL = 1.0  # what follows a search takes as long as its first fit
STRAYS = 3.0  # times what noise alone makes of a free run's error; 70 healthy drives: 2.3 at most
Notify = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search ended with, ready to be told, or taken further by what other cars show.

    Attributes:
        recordings, drives: That were usable.
        car: As given.
        rough: Whether the car was judged by strides.
        held, sought: What a law was held against; None where none was looked for.
        unasked: Questions that there was no time for.
    """

    recordings: Sequence[Recording]
    drives: Sequence[Drive]
    car: Car
    model: Likelihood
    parts: Parts
    search: Search
    best: Fitted
    rough: bool
    tried: tuple[Tried, ...]
    held: Standing | None
    sought: Sought | None
    unasked: tuple[Unanswered, ...] = ()


@dataclass(frozen=True, slots=True)
class Found:
    """A diagnosis with what the report needs beside it.

    Attributes:
        car: As given.
        model: Of the recordings; None where they cannot be used, like the two fits.
        best: What was found; `retuned`: the car's own numbers refitted alone.
        suggestions: Drives that would tell what this one cannot.
        searched: What it was told from; None where nothing could be searched.
        found_car, retuned_car: As their written files say; None where none could be written.
        files: Keeps the folder of those files.
        account: Which rows were read, a line a recording.
    """

    diagnosis: Diagnosis
    car: Car
    evidence: Evidence
    model: Likelihood | None = None
    best: Fitted | None = None
    retuned: Fitted | None = None
    suggestions: tuple[Suggestion, ...] = ()
    searched: Searched | None = None
    found_car: Car | None = None
    retuned_car: Car | None = None
    files: CarFiles | None = None
    account: tuple[str, ...] = ()


def diagnose(
    paths: Sequence[Path | str],
    car_file: str | None = None,
    data: Path | None = None,
    *,
    vehicle: str | None = None,
    span_s: tuple[float | None, float | None] = (None, None),
    told: Sequence[Path | str] = (),
    budget_s: float = DEFAULT_S,
    strict: bool = False,
    notify: Notify = lambda _: None,
    clock: Clock | None = None,
) -> Found:
    """Return what a simulator lacks to explain recordings of one car.

    Args:
        paths: Recordings' folders or descriptions, or runs of a city.
        car_file: The car's name or file; None takes the recordings' own.
        data: Folder of the recordings' tables; None: beside each description.
        vehicle: Of recordings of several cars the name of the one; None: they are of one.
        span_s: Part of each recording, seconds since its begin; None: its end.
        told: Recordings of the same car by `scm play`, whatever they call it; taken whole.
        budget_s: What is not found in time to be told after so long, is not looked for.
        strict: Refuse recordings in which anything has to be left out or repaired.
        notify: Is told what is being tried.
        clock: For the time it takes.

    Raises:
        ScmError: when a recording or the car file cannot be read.
    """
    budget = Budget(budget_s, clock or WallClock())
    recordings = [
        part_of(one, *span_s) for path in paths for one in recordings_of_one(path, data, vehicle)
    ]
    recordings += [one for path in told for one in recordings_of_one(path)]
    file = car_file or recordings[0].vehicle
    car = load_car(file, trusted=car_file is not None)
    if car_file is None and any(r.vehicle != file for r in recordings):
        msg = f"{paths[0]}: recordings of several cars; say which with --car"
        raise RecordingError(msg)
    return diagnose_car(recordings, car, budget=budget, strict=strict, notify=notify)


def diagnose_car(
    recordings: Sequence[Recording],
    car: Car,
    *,
    budget_s: float = DEFAULT_S,
    budget: Budget | None = None,
    strict: bool = False,
    notify: Notify = lambda _: None,
    clock: Clock | None = None,
) -> Found:
    """Return what `diagnose` does, of recordings that were read already, all of one car.

    Args:
        recordings: As they were read.
        car: As given.
        budget_s: As in `diagnose`.
        budget: One that began with the reading, in place of `budget_s`.
        strict: As in `diagnose`, like `notify` and `clock`.
        notify: Is told what is being tried.
        clock: For the time it takes.

    Raises:
        ScmError: when a recording cannot be used as such a car's.
    """
    budget = budget or Budget(budget_s, clock or WallClock())
    notify("doubting the data")
    prepared = [prepare(recording, car, strict=strict) for recording in recordings]
    usable, problems = _usable(recordings, prepared)
    account = tuple(one.account[0] for one in prepared)  # what was done is in the problems
    if not usable:
        return replace(_nothing(recordings, car, problems, budget.spent_s()), account=account)
    usable, partly = sampled(usable, budget.allowed_s())
    with threadpool_limits(1):  # two threads drive already: more for small matrices only wait
        found = _searched(usable, car, notify, budget)
    diagnosis = structs.replace(
        found.diagnosis, data=(*problems, *partly), runtime_s=budget.spent_s(),
        processor_share=budget.processor_share(), compared_s=budget.allowed_s(),
    )  # fmt: skip
    return replace(found, diagnosis=diagnosis, account=account)


def usable_of(
    recordings: Sequence[Recording], car: Car, allowed_s: float = math.inf
) -> list[Recording]:
    """Return the stretches of recordings that a diagnosis would use, repaired.

    Args:
        recordings: As they were read.
        car: As given.
        allowed_s: How much of them the budget let be compared.
    """
    usable, _ = _usable(recordings, [prepare(recording, car) for recording in recordings])
    return sampled(usable, allowed_s)[0]


def _usable(
    recordings: Sequence[Recording], every: Sequence[Prepared]
) -> tuple[list[Recording], tuple[DataProblem, ...]]:
    """Return the recordings that can be used, repaired, and everything wrong with any."""
    usable, problems = list[Recording](), list[DataProblem]()
    length_s = _length_s([part for one in every for part in one.recordings])
    for recording, one in zip(recordings, every, strict=True):
        quality = one.quality
        together = length_s > SHORTEST_S and _is_only_short(quality)
        where = f"{_titles([recording])[0]}: " if len(recordings) > 1 else ""
        problems += [
            structs.replace(p, text=where + p.text)
            for p in one.problems
            if not together or p.name not in OF_SHORT
        ]
        if together or quality.usable.can_diagnose:
            usable += one.recordings
    return usable, tuple(problems)


def _length_s(recordings: Sequence[Recording]) -> float:
    """Return how long recordings with poses are together."""
    posed = [clean(r.channel(POSE_X)).t for r in recordings if POSE_X in r.channels]
    return sum(recorded_s(t) for t in posed if len(t))


def _is_only_short(quality: Quality) -> bool:
    """Say whether a recording lacks nothing but length, which several have together."""
    lacks = quality.usable.lacks
    return bool(lacks) and all(lack.startswith("only ") for lack in lacks)


def write(found: Found, out: Path, check: str = "") -> None:
    """Write the report, the car found, the re-tuned car, `retuned.toml`, and the next drive.

    A drive that would tell what this one cannot goes to `next_drive/`, for `scm play`; that of a
    second question to `next_drive_2/`.

    Args:
        found: To be written.
        out: Folder of the report.
        check: The command that works out the report's figures again; empty: none is printed.

    Raises:
        ScmError: when the folder cannot be written.
    """
    found_car = found.found_car or found.car
    write_report(found.diagnosis, found.evidence, found.car, found_car, out, check)
    retuned = found.retuned_car or found.car
    shutil.copyfile(retuned.path, out / RETUNED)
    folders = folders_of([suggestion.undecided for suggestion in found.suggestions])
    for suggestion, name in zip(found.suggestions, folders, strict=True):
        if name:
            write_scenario(suggestion, str(found.car.path), out / name)


def _curves(model: Likelihood, best: Fitted, sought: Sought | None) -> tuple[Curve, ...]:
    """Return the effects found as curves; a law with its bins beside it."""
    drawn = [curve(model, best, e) for e in best.effects if not is_discovered(e)]
    of_laws = discovered_curves(best, sought) if sought is not None else ()
    return (*(c for c in drawn if c is not None), *of_laws)


def _judged(searched: Searched, car: Car | None) -> tuple[Fit | None, FreeRuns | None]:
    """Return free runs before and after; nothing where no part has a whole window, or no file."""
    if car is None:
        return None, None
    before = searched.model.car
    try:
        return judge(searched.drives, before, on(before, car), searched.parts)
    except RecordingError:
        return None, None


def retuned_error(searched: Searched, retuned: Car | None, found: Car | None) -> float | None:
    """Return how far the re-tuned car strays [m] in the windows in which the one found is judged.

    None where no part has a whole window, or a car has no file.
    """
    fit = _beside_retuned(searched, retuned, found)
    return None if fit is None else fit.confirm.before.get(POSE[0])


def strays_more(searched: Searched, fit: Fit, retuned: Car | None, found: Car | None) -> bool:
    """Return whether a car strays farther than the given one, or than the re-tuned one.

    Args:
        searched: Whose recordings they are driven by.
        fit: Of the found car and the one given.
        retuned: With the given car's own numbers refitted, and nothing else.
        found: With effects.
    """
    beside = _beside_retuned(searched, retuned, found)
    fits = (fit,) if beside is None else (fit, beside)
    return any(POSE[0] in nothing_got_worse(one) for one in fits)


def _beside_retuned(searched: Searched, retuned: Car | None, found: Car | None) -> Fit | None:
    """Return free runs of the re-tuned car and of the one found, as of `before` and `after`."""
    if retuned is None or found is None:
        return None
    base = searched.model.car
    try:
        return judge(searched.drives, on(base, retuned), on(base, found), searched.parts)[0]
    except RecordingError:
        return None


def gained_nothing(fit: Fit) -> bool:
    """Return whether the car's own numbers, refitted, bring it no nearer on unseen parts."""
    before, after = fit.confirm.before, fit.confirm.after
    return POSE[0] in before and after[POSE[0]] >= before[POSE[0]]


def as_given(fitter: Fitter, best: Fitted) -> Fitted:
    """Return the car with its own numbers as its file gives them, as sure as the file is."""
    as_said = replace(best, z=fitter.model.as_said())
    return replace(fitter.at(as_said), covariance=np.eye(len(best.z)))


def verdict_of(
    effects: Sequence[Effect], undecided: Sequence[Undecided], fit: Fit | None
) -> Verdict:
    """Return the verdict; a car that strays for no cause that was tried is a mismatch too."""
    if undecided:
        return Verdict.UNDECIDED
    after, floor = (fit.confirm.after, fit.confirm.noise_floor) if fit else ({}, {})
    strays = any(after[name] > STRAYS * floor[name] for name in POSE if name in after)
    return Verdict.MISMATCH if effects or strays else Verdict.NONE


def _nothing(
    recordings: Sequence[Recording], car: Car, problems: tuple[DataProblem, ...], took_s: float
) -> Found:
    none = Diagnosis(verdict=Verdict.NONE, located=(), effects=(), undecided=(), fit=None,
                     runtime_s=took_s, data=problems)  # fmt: skip
    evidence = Evidence(vehicle=car.name, recordings=_titles(recordings))
    return Found(none, car, evidence)


def _titles(recordings: Sequence[Recording]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(map(_title, recordings)))  # stretches have one title


def _pauses(searched: Searched) -> tuple[tuple[float, float], ...]:
    """Return what `Evidence.pauses` holds; nothing of several recordings, or of a whole one."""
    recordings, drives = searched.recordings, searched.drives
    if len(drives) == 1 or len({(r.path, r.name) for r in recordings}) > 1:
        return ()
    moves = on_one_axis(drives)
    return tuple((float(d.edges[0]) + move, -move) for d, move in zip(drives, moves, strict=True))


def _title(recording: Recording) -> str:
    path = recording.path
    if path.suffix == SUFFIX:
        return f"{recording.name} of {path.stem}"
    return path.parent.name if path.name == "recording.yaml" else path.stem


def _searched(recordings: Sequence[Recording], car: Car, notify: Notify, budget: Budget) -> Found:
    big = car.with_terms(terms_needed(car))
    drives = [Drive(recording, big) for recording in recordings]
    model: Likelihood = with_general_effect(Likelihood(drives, big))
    parts = split(model)
    library = placed(shown_by(candidates(big), drives), drives)
    search = Search(model, parts.fit.weight + parts.choose.weight, library, notify, budget=budget)
    begun_s, held, sought = budget.spent_s(), None, None
    far, unseen = is_far(search), parts.confirm.weight  # the car's own numbers are fitted here
    budget.keep(TAIL * (budget.spent_s() - begun_s))
    laws = Lawful(search, unseen, notify)
    if far:  # maybe for one large effect, which the re-tuned car takes for disturbances
        search.settles, search.explained = SETTLES_FAR, lambda _: strays(model)
    else:
        search.explained = laws.explains_all
    best = search.run(lambda: far and bool(search.steps) and strays(search.model))
    rough = far and strays(model)
    if not rough:
        held, tried = standing(search, best, unseen=bool(unseen.any())), tried_of(search)
        best, sought = laws.decide(best)
        rough = strays(model)
    if rough:
        many = search.within(Question.STRIDES, partial(_by_strides, search, big, library))
        held, sought, rough = None, None, many is not None
        model, parts, search = many or (model, parts, search)
        best = search.run() if rough else search.retuned
        tried = tried_of(search)
    notify("judging on what the fit did not see")
    best = search.confirmed(best, parts.confirm.weight)
    searched = Searched(
        recordings, drives, car, model, parts, search, best, rough, tried, held, sought,
        budget.unasked,
    )  # fmt: skip
    return told(searched, notify)


def _by_strides(
    search: Search, car: Car, library: Sequence[Candidate]
) -> tuple[Likelihood, Parts, Search]:
    """Return what `by_windows` does, the car's own numbers fitted."""
    many = by_windows(search.model.drives, car, library, search.notify, search.budget)
    many[2].retuned  # noqa: B018 it is fitted when first asked for
    return many


def told(searched: Searched, notify: Notify) -> Found:
    """Return the diagnosis that a search's best model is, judged, located and put into words."""
    model, search = searched.model, searched.search
    car, best, rough = searched.car, searched.best, searched.rough
    titles = _titles(searched.recordings)
    files = CarFiles(car, model, titles)
    _, retuned_car = _written(searched, files, search.retuned)
    effects, found_car = _written(searched, files, best)
    fit, free_runs = _judged(searched, found_car)
    while (
        rough and best.effects and fit is not None
        and strays_more(searched, fit, retuned_car, found_car)
    ):  # fmt: skip
        best = search.without_one(best)
        effects, found_car = _written(searched, files, best)
        fit, free_runs = _judged(searched, found_car)
    if not best.effects and fit is not None and gained_nothing(fit):
        best, found_car = as_given(search.fitter, best), car
        fit, free_runs = _judged(searched, car)
    retuned_m = retuned_error(searched, retuned_car, found_car) if best.effects else None
    located, residuals = locate(model, search.retuned, best)
    suggestions = () if rough else undecided_of(model, search, best, notify)
    undecided = tuple(suggestion.undecided for suggestion in suggestions)
    verdict = verdict_of(effects, undecided, fit)
    if verdict is Verdict.MISMATCH and not effects and fit and free_runs:
        located = strayed(free_runs, fit)
    diagnosis = Diagnosis(verdict=verdict, located=located, effects=effects, undecided=undecided,
                          fit=fit, runtime_s=0.0, unanswered=searched.unasked)  # fmt: skip
    evidence = Evidence(
        vehicle=car.name, recordings=titles, residuals=residuals, free_runs=free_runs,
        refitted=as_written(ordinary_of(model, best, car), found_car or car), tried=searched.tried,
        curves=_curves(model, best, searched.sought), retuned_m=retuned_m,
        pauses=_pauses(searched),
        widened=widened_of(model, car),
    )  # fmt: skip
    return Found(
        diagnosis, car, evidence, model, best, search.retuned, suggestions, searched, found_car,
        retuned_car, files,
    )  # fmt: skip


def _written(
    searched: Searched, files: CarFiles, fitted: Fitted
) -> tuple[tuple[Effect, ...], Car | None]:
    """Return a model's effects, and its car as the written file says; None where none loads."""
    effects = tuple(
        effect_of(searched.search, fitted, i, searched.held, searched.sought)
        for i in range(len(fitted.effects))
    )
    try:
        return effects, files.written(fitted, effects)
    except ScmError:
        return effects, None
