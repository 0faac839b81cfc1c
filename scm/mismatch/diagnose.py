"""A whole diagnosis: read, doubt, fit, search, judge, say."""

import math
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from scm.clock import Clock, WallClock, seconds
from scm.errors import RecordingError
from scm.mismatch.doubt.corrected import corrected
from scm.mismatch.doubt.doubt import doubt
from scm.mismatch.drive import Drive
from scm.mismatch.evidence import Evidence, Ordinary, Tried
from scm.mismatch.experiment.plan import Rival as Contender
from scm.mismatch.experiment.suggest import suggest
from scm.mismatch.findings import (
    DataProblem,
    Diagnosis,
    Effect,
    Estimate,
    Rival,
    Undecided,
    Verdict,
)
from scm.mismatch.fit import Fitted
from scm.mismatch.judge import judge
from scm.mismatch.library import Candidate, candidates, placed, shown_by, terms_needed
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.locate import locate
from scm.mismatch.parts import split
from scm.mismatch.report.car_file import write_car
from scm.mismatch.report.write import write_report
from scm.mismatch.search import Search, price
from scm.recording.read import Recording, read_recordings
from scm.vehicles.car import Car, load_car

NINETY = 1.645
WIDER = 1.3  # intervals from curvature alone are too narrow for what any model leaves out
TIE = 6.0
Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Found:
    """A diagnosis with what the report needs beside it.

    Attributes:
        car: As given; `patched`: with the effects found and its own numbers refitted.
        retuned: With its own numbers refitted alone.
    """

    diagnosis: Diagnosis
    car: Car
    patched: Car
    retuned: Car
    evidence: Evidence


def diagnose(
    paths: Sequence[Path | str],
    car_file: str | None = None,
    *,
    budget_s: float = 120.0,
    tell: Tell = lambda _: None,
    clock: Clock | None = None,
) -> Found:
    """Return what a simulator lacks to explain recordings of one car.

    Args:
        paths: Recordings' folders or descriptions.
        car_file: The car's name or file; None takes the recordings' own.
        budget_s: After so long no further effect is looked for.
        tell: Is told what is being tried.
        clock: For the time it took.

    Raises:
        ScmError: when a recording or the car file cannot be read.
    """
    clock = clock or WallClock()
    began_ns = clock.now_ns()
    recordings = [one for path in paths for one in read_recordings(path)]
    vehicle = car_file or recordings[0].vehicle
    car = load_car(vehicle)
    if car_file is None and any(r.vehicle != vehicle for r in recordings):
        msg = f"{paths[0]}: recordings of several cars; say which with --car"
        raise RecordingError(msg)
    tell("doubting the data")
    usable, problems = _doubted(recordings, car)
    if not usable:
        return _nothing(recordings, car, problems, seconds(clock.now_ns() - began_ns))
    with threadpool_limits(1):  # two threads drive already: more for small matrices only wait
        found = _searched(usable, car, tell, lambda: seconds(clock.now_ns() - began_ns) > budget_s)
    diagnosis = replace(
        found.diagnosis, data=problems, runtime_s=seconds(clock.now_ns() - began_ns)
    )
    return replace(found, diagnosis=diagnosis)


def _doubted(
    recordings: Sequence[Recording], car: Car
) -> tuple[list[Recording], tuple[DataProblem, ...]]:
    """Return the recordings that can be used, repaired, and everything wrong with any."""
    usable, problems = list[Recording](), list[DataProblem]()
    for recording in recordings:
        doubts = doubt(recording, car)
        problems += doubts.problems
        if doubts.usable.can_diagnose:
            usable.append(corrected(recording, doubts))
    return usable, tuple(problems)


def write(found: Found, out: Path) -> None:
    """Write the report, the car found and the re-tuned car, `retuned.toml`, into a folder.

    Raises:
        ScmError: when the folder cannot be written.
    """
    write_report(found.diagnosis, found.evidence, found.car, found.patched, out)
    retuned = replace(found.diagnosis, effects=())
    with tempfile.TemporaryDirectory() as folder:
        write_car(retuned, found.evidence, found.car, found.retuned, Path(folder))
        shutil.copy(Path(folder) / "car.toml", out / "retuned.toml")


def _nothing(
    recordings: Sequence[Recording], car: Car, problems: tuple[DataProblem, ...], took_s: float
) -> Found:
    none = Diagnosis(verdict=Verdict.NONE, located=(), effects=(), undecided=(), fit=None,
                     runtime_s=took_s, data=problems)  # fmt: skip
    evidence = Evidence(vehicle=car.name, recordings=_titles(recordings))
    return Found(none, car, car, car, evidence)


def _titles(recordings: Sequence[Recording]) -> tuple[str, ...]:
    return tuple(
        r.path.parent.name if r.path.name == "recording.yaml" else r.path.stem for r in recordings
    )


def _searched(
    recordings: Sequence[Recording], car: Car, tell: Tell, is_over: Callable[[], bool]
) -> Found:
    big = car.with_terms(terms_needed(car))
    drives = [Drive(recording, big) for recording in recordings]
    model = Likelihood(drives, big)
    parts = split(model)
    library = placed(shown_by(candidates(big), drives), drives)
    search = Search(model, parts.fit.weight + parts.choose.weight, library, tell)
    best = search.run(is_over)
    tell("judging on what the fit did not see")
    best = search.confirmed(best, parts.confirm.weight)
    numbers = search.fitter.numbers(best.effects, best.z, best.values)
    fit, free_runs = judge(drives, big, {}, numbers, parts)
    located, residuals = locate(model, search.retuned, best)
    effects = tuple(_effect(search, best, i) for i in range(len(best.effects)))
    undecided = _undecided(model, search, best, tell)
    verdict = Verdict.NONE if not effects else Verdict.MISMATCH
    if undecided:
        verdict = Verdict.UNDECIDED
    diagnosis = Diagnosis(verdict=verdict, located=located, effects=effects, undecided=undecided,
                          fit=fit, runtime_s=0.0)  # fmt: skip
    evidence = Evidence(
        vehicle=car.name, recordings=_titles(recordings), residuals=residuals,
        free_runs=free_runs, ordinary=_ordinary(model, best, car), tried=_tried(search),
    )  # fmt: skip
    return Found(
        diagnosis, car, patched(car, model, best), patched(car, model, search.retuned), evidence
    )


def _ordinary(model: Likelihood, best: Fitted, car: Car) -> tuple[Ordinary, ...]:
    """Return the car's own numbers, as the file gives them and as the recordings do."""
    found = []
    for j, own in enumerate(model.ordinary):
        if own.key.startswith("clock."):
            continue
        std = math.sqrt(max(best.covariance[j, j], 0.0)) * own.std
        value = model.numbers(best.z)[own.key]
        unit = model.unit(own.key)
        estimate = Estimate(
            value=value, low=value - NINETY * std, high=value + NINETY * std, unit=unit
        )
        given = car.value(own.key) if car.has(own.key) else own.mean
        found.append(Ordinary(key=own.key, given=given, given_std=own.std, found=estimate))
    return tuple(found)


def _tried(search: Search) -> tuple[Tried, ...]:
    """Return every effect tried beside the re-tuned car, best first."""
    best: dict[str, Tried] = {}
    for base, fitted in [(step.base, f) for step in search.steps[:1] for f in step.rivals]:
        name = fitted.names[-1]
        needed = price(fitted.effects, search.events, len(search.library))
        one = Tried(name=name, gain=base.q - fitted.q, needed=needed)
        if name not in best or best[name].gain < one.gain:
            best[name] = one
    return tuple(sorted(best.values(), key=lambda tried: -tried.gain))


def _effect(search: Search, best: Fitted, i: int) -> Effect:
    """Return what is reported of one effect of the model found."""
    candidate = best.effects[i]
    at = sum(len(effect.knobs) for effect in best.effects[:i])
    own, estimates = len(best.z), dict[str, Estimate]()
    for j, knob in enumerate(candidate.knobs):
        value, place = float(best.values[at + j]), own + at + j
        spread = WIDER * NINETY * knob.step * math.sqrt(max(best.covariance[place, place], 0.0))
        low, high = knob.bounds
        estimates[knob.name] = Estimate(
            value=value, low=max(value - spread, low), high=min(value + spread, high),
            unit=knob.unit,
        )  # fmt: skip
    probability, rivals = _rivals(search, candidate)
    return Effect(
        name=candidate.name,
        listed=True,
        equation=candidate.equation,
        depends_on=candidate.depends_on,
        parameters=estimates,
        probability=probability,
        said=said(candidate, estimates),
        rivals=rivals,
    )


def said(candidate: Candidate, estimates: dict[str, Estimate]) -> str:
    """Return an effect's sentence with its numbers."""
    words = {name: _number(e.value, e.unit) for name, e in estimates.items()}
    return candidate.said.format(**words)


def _number(value: float, unit: str) -> str:
    text = f"{value:.3g}"
    return text if unit == "1" else f"{text} {unit.replace('*', ' ')}"


def _rivals(search: Search, candidate: Candidate) -> tuple[float, tuple[Rival, ...]]:
    """Return an effect's probability among all that were tried in its place, and the next ones."""
    step = search.step_of(candidate)
    if step is not None:
        tried = list(zip(step.rivals, step.criteria, strict=True))
        lowest = min(c for _, c in tried)
        weights = {id(f): math.exp(-0.5 * min(c - lowest, 1400.0)) for f, c in tried}
        total = sum(weights.values())
        mine = sum(weights[id(f)] for f, _ in tried if f.names[-1] == candidate.name)
        others = [(f, c) for f, c in tried if f.names[-1] != candidate.name][:5]
        return mine / total, tuple(
            Rival(name=f.names[-1], probability=weights[id(f)] / total,
                  ruled_out_by=_against(c - lowest))
            for f, c in others
        )  # fmt: skip
    return 1.0, ()


def _against(worse: float) -> str:
    if worse < TIE:
        return "nothing in this recording"
    return f"the recording: it explains it worse by {math.sqrt(worse):.1f} standard deviations"


def _undecided(
    model: Likelihood, search: Search, best: Fitted, tell: Tell
) -> tuple[Undecided, ...]:
    """Return which effects found could as well be others, and the drive that would tell."""
    found = []
    for effect in best.effects:
        step = search.step_of(effect)
        if step is None:
            continue
        lowest = next(
            c for f, c in zip(step.rivals, step.criteria, strict=True) if f.names[-1] == effect.name
        )
        near = [
            Contender(f.effects, f.values)
            for f, c in zip(step.rivals, step.criteria, strict=True)
            if c - f.effects[-1].rare < lowest + TIE and f.names[-1] not in best.names
        ]
        if near:
            tell("designing the drive that would tell")
            mine = next(f for f in step.rivals if f.names[-1] == effect.name)
            contenders = [Contender(mine.effects, mine.values), *near]
            found.append(suggest(model, contenders, tell=tell).undecided)
    return tuple(found)


def patched(car: Car, model: Likelihood, fitted: Fitted) -> Car:
    """Return the given car with effects found and with the numbers of its own that are known.

    A number that the recordings leave as uncertain as the file does keeps the file's value.
    """
    spread = np.sqrt(np.maximum(fitted.covariance.diagonal(), 0.0))
    numbers = {
        o.key: model.numbers(fitted.z)[o.key]
        for o, std in zip(model.ordinary, spread, strict=False)
        if not o.key.startswith("clock.") and std < 0.8
    }
    terms, faults, at = list[str](), list[str](), 0
    known = {term.name for term in car.terms}
    for effect in fitted.effects:
        n = len(effect.knobs)
        numbers |= effect.numbers(tuple(fitted.values[at : at + n]))
        at += n
        if effect.equation == "sensor" and effect.name != "wheel_radius":
            faults.append(effect.name)
        elif effect.name not in known and effect.name != "wheel_radius":
            terms.append(effect.name)
    if any(key.startswith("measure.pose_point") for key in numbers) and "pose_point" not in faults:
        faults.append("pose_point")
    sensed = {key: value for key, value in numbers.items() if key.startswith("measure.")}
    driven = {key: value for key, value in numbers.items() if key not in sensed}
    found = car.with_terms(terms, driven)
    return found.with_measures(faults, sensed) if faults else found
