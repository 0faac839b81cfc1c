"""A whole diagnosis: read, doubt, fit, search, judge, say."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scm.clock import Clock, WallClock, seconds
from scm.errors import RecordingError
from scm.mismatch.doubt.corrected import corrected
from scm.mismatch.doubt.doubt import doubt
from scm.mismatch.drive import Drive
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
from scm.mismatch.library import Candidate, candidates, shown_by, terms_needed
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.search import Search
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
    search: Search | None = None
    best: Fitted | None = None


def diagnose(
    paths: Sequence[Path | str],
    car_file: str | None = None,
    *,
    tell: Tell = lambda _: None,
    clock: Clock | None = None,
) -> Found:
    """Return what a simulator lacks to explain recordings of one car.

    Args:
        paths: Recordings' folders or descriptions.
        car_file: The car's name or file; None takes the recordings' own.
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
        return _nothing(car, problems, seconds(clock.now_ns() - began_ns))
    found = _searched(usable, car, tell)
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


def _nothing(car: Car, problems: tuple[DataProblem, ...], took_s: float) -> Found:
    none = Diagnosis(verdict=Verdict.NONE, located=(), effects=(), undecided=(), fit=None,
                     runtime_s=took_s, data=problems)  # fmt: skip
    return Found(none, car, car, car)


def _searched(recordings: Sequence[Recording], car: Car, tell: Tell) -> Found:
    big = car.with_terms(terms_needed(car))
    drives = [Drive(recording, big) for recording in recordings]
    model = Likelihood(drives, big)
    library = shown_by(candidates(big), drives)
    search = Search(model, np.ones(len(model.t)), library, tell)
    best = search.run()
    effects = tuple(_effect(search, best, i) for i in range(len(best.effects)))
    undecided = tuple(_undecided(effect) for effect in effects if _ties(effect))
    verdict = Verdict.NONE if not effects else Verdict.MISMATCH
    if undecided:
        verdict = Verdict.UNDECIDED
    diagnosis = Diagnosis(verdict=verdict, located=(), effects=effects, undecided=undecided,
                          fit=None, runtime_s=0.0)  # fmt: skip
    return Found(
        diagnosis, car, patched(car, model, best), patched(car, model, search.retuned), search, best
    )


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
    for step in search.steps:
        tried = [(f, c) for f, c in zip(step.rivals, step.criteria, strict=True)]
        tried = [(f, c) for f, c in tried if not step.base.effects or f.effects[-1] is not None]
        if not any(f.effects[-1] is candidate for f, _ in tried):
            continue
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


def _ties(effect: Effect) -> bool:
    return any(r.ruled_out_by == "nothing in this recording" for r in effect.rivals)


def _undecided(effect: Effect) -> Undecided:
    names = [r.name for r in effect.rivals if r.ruled_out_by == "nothing in this recording"]
    return Undecided(between=(effect.name, *names), drive_this="", expected_separation=0.0)


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
