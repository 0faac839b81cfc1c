"""A whole diagnosis: check data, fit the car's own numbers, select effects, validate, report."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from msgspec import structs
from threadpoolctl import threadpool_limits

from scm.clock import Clock, WallClock
from scm.errors import RecordingError
from scm.mismatch.budget import DEFAULT_S, Budget
from scm.mismatch.evidence import Evidence
from scm.mismatch.experiment.scenario import write_scenario
from scm.mismatch.findings import Diagnosis, Verdict, folders_of
from scm.mismatch.report.car_file import FILE, write_own_terms
from scm.mismatch.report.write import write_report
from scm.mismatch.select.round import Notify
from scm.mismatch.select.selected import fit_nominal, select_effects
from scm.mismatch.usable_data import Data, check
from scm.mismatch.validate.conclude import Result, conclude
from scm.mismatch.validate.free_runs import with_accuracy
from scm.recorder.drives import recordings_of_one
from scm.recording.read import Recording
from scm.recording.span import part_of
from scm.vehicles.car import Car, load_car

RETUNED = "retuned.toml"


def diagnose(
    paths: Sequence[Path | str],
    car_file: str | None = None,
    data: Path | None = None,
    *,
    vehicle: str | None = None,
    span_s: tuple[float | None, float | None] = (None, None),
    played: Sequence[Path | str] = (),
    budget_s: float = DEFAULT_S,
    strict: bool = False,
    notify: Notify = lambda _: None,
    clock: Clock | None = None,
) -> Result:
    """Return what a simulator lacks to explain recordings of one car.

    Args:
        paths: Recordings' folders or descriptions, or runs of a city.
        car_file: The car's name or file; None uses the recordings' own.
        data: Folder of the recordings' tables; None: beside each description.
        vehicle: Of recordings of several cars the name of the one; None: they are of one.
        span_s: Part of each recording, seconds since its begin; None: its end.
        played: Recordings of the same car by `scm play`, whatever they call it; used whole.
        budget_s: What is not found in time to be reported after so long, is not searched for.
        strict: Refuse recordings in which anything has to be left out or repaired.
        notify: Receives what is being tried.
        clock: For the time it takes.

    Raises:
        ScmError: when a recording or the car file cannot be read.
    """
    budget = Budget(budget_s, clock or WallClock())
    recordings = [
        part_of(one, *span_s) for path in paths for one in recordings_of_one(path, data, vehicle)
    ]
    recordings += [one for path in played for one in recordings_of_one(path)]
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
    budget: Budget | None = None,
    strict: bool = False,
    notify: Notify = lambda _: None,
) -> Result:
    """Return what `diagnose` does, of recordings that were read already, all of one car.

    Args:
        recordings: As they were read.
        car: As given.
        budget: That began with the reading.
        strict: As in `diagnose`, like `notify`.
        notify: Receives what is being tried.

    Raises:
        ScmError: when a recording cannot be used as such a car's.
    """
    budget = budget or Budget(DEFAULT_S, WallClock())
    notify("checking the data")
    data = check(recordings, car, budget.compared_s(), strict=strict)
    if not data.recordings:
        return _unusable(data, car, budget)
    with threadpool_limits(1):  # two threads drive already: more for small matrices only wait
        nominal = fit_nominal(data.recordings, car, budget, notify)
        result = conclude(select_effects(nominal), notify)
    diagnosis = structs.replace(
        result.diagnosis, data=data.problems, runtime_s=budget.spent_s(),
        processor_share=budget.processor_share(), compared_s=budget.compared_s(),
    )  # fmt: skip
    return replace(result, diagnosis=diagnosis, account=data.account)


def _unusable(data: Data, car: Car, budget: Budget) -> Result:
    diagnosis = Diagnosis(verdict=Verdict.NONE, located=(), effects=(), undecided=(), fit=None,
                          runtime_s=budget.spent_s(), data=data.problems)  # fmt: skip
    evidence = Evidence(vehicle=car.name, recordings=data.titles)
    return Result(diagnosis, car, evidence, account=data.account)


def write(found: Result, out: Path, check: str = "") -> None:
    """Write the report, the car found, the re-tuned car, `retuned.toml`, and the next drive.

    A drive that would answer what this one cannot goes to `next_drive/`, for `scm play`; that of a
    second question to `next_drive_2/`.

    Args:
        found: To be written.
        out: Folder of the report.
        check: The command that computes the report's figures again; empty: none is printed.

    Raises:
        ScmError: when the folder cannot be written.
    """
    found_car, fit, runs = found.found_car, found.diagnosis.fit, found.evidence.free_runs
    if found_car is None or found_car is found.car:
        found_car = found.car
    elif fit is not None and runs is not None:
        found_car = with_accuracy(found_car, fit, runs)
    write_report(found.diagnosis, found.evidence, found.car, found_car, out, check)
    retuned = found.retuned_car or found.car
    shutil.copyfile(retuned.path, out / RETUNED)
    for stage in found.stages:
        if stage.file == FILE:
            continue
        shutil.copyfile(stage.car.path, out / stage.file)
        write_own_terms(stage.car, out)
    folders = folders_of([suggestion.undecided for suggestion in found.suggestions])
    for suggestion, name in zip(found.suggestions, folders, strict=True):
        if name:
            write_scenario(suggestion, str(found.car.path), out / name)
