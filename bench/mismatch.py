"""Names of concealed effects and held-out error: this engine, PySINDy and a Gaussian process.

All three get the same recordings of the independent reality and the same car files. It takes some
minutes and is not part of `make bench`: `python -m bench mismatch [CASES [SEED]]`, or with a folder
of cases that are there, `python -m bench mismatch DIR`; diagnoses in `DIR/found` are taken.
"""

import argparse
import os
import statistics
import tempfile
import time
import warnings
from collections import defaultdict
from pathlib import Path

from bench.mismatch_free_run import gaussian_pushes, position_error, sindy_pushes
from bench.mismatch_peers import Gaussian, Sindy, calibrated
from bench.mismatch_residuals import residuals
from scm.mismatch.trial import labels
from scm.mismatch.trial.run import (
    CaseRequest,
    answer_all,
    by_engine,
    make_cases,
    processes,
    stored_answers,
)
from scm.mismatch.trial.score import score
from scm.recording.read import read_recordings
from scm.vehicles.car import load_car
from scm.vehicles.sensor_correction import without_faults

CASES, SEED = 12, 77
HEALTHY, HEALTHY_SEED = 12, 901
ROWS = ("this engine", "PySINDy as shipped", "PySINDy, largest term", "PySINDy calibrated",
        "Gaussian process", "nominal car")  # fmt: skip


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench mismatch", description=__doc__)
    parser.add_argument(
        "cases", nargs="?", type=count_or_folder, default=CASES,
        help=f"how many (default {CASES}), or a folder of cases that are there",
    )  # fmt: skip
    parser.add_argument("seed", nargs="?", type=int, default=SEED)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as made:
        folder = given.cases
        if isinstance(folder, int):
            folder = Path(made) / "cases"
            make_cases(CaseRequest(seed=given.seed, cases=given.cases), folder, lambda _: None)
        healthy = Path(made) / "healthy"
        make_cases(
            CaseRequest(seed=HEALTHY_SEED, cases=HEALTHY, kind="none"), healthy, lambda _: None
        )
        compare(folder, healthy)


def count_or_folder(text):
    return Path(text) if Path(text).is_dir() else int(text)


def compare(folder, healthy):
    """Let all judge the cases of a folder and print how they did."""
    sparse = _calibrated(healthy)
    cases, opened = labels.find_cases(folder), _labels(folder)
    answers = {a.case.name: a for a in stored_answers(cases, folder / "found")}
    wanted = [case for case in cases if case.name not in answers] if not answers else []
    with processes(2) as executor:
        new = answer_all(wanted, folder / "found", by_engine, executor)
        answers |= {a.case.name: a for a in new}
    table = defaultdict(lambda: defaultdict(list))
    for case in cases:
        if case.name in answers:
            _one(case, opened[case.name], answers[case.name], sparse, folder / "found", table)
    _print(table)


def _calibrated(healthy):
    found = defaultdict(list)
    for case in labels.find_cases(healthy):
        recording = read_recordings(case.drive)[0]
        found[recording.vehicle].append(residuals(recording, load_car(recording.vehicle)))
    return {car: calibrated(several) for car, several in found.items()}


def _labels(folder):
    beside = folder / "labels.json"
    if beside.is_file():
        return labels.shipped_labels(beside)
    seals = labels.read_seals(folder)
    return {case: labels.open_label(folder, case, digest) for case, digest in seals.items()}


def _one(case, label, answer, sparse, found, table):
    recording, again = (read_recordings(p)[0] for p in (case.drive, case.again))
    car = load_car(recording.vehicle)
    errors = {"nominal car": position_error(again, car, None)}
    if answer.diagnosis is not None:
        outcome = score(label, answer.diagnosis)
        _count(table["this engine"], label, outcome.exact, outcome.among, bool(outcome.reported))
        table["this engine"]["seconds"].append(outcome.runtime_s)
        if (found / case.name / "car.toml").is_file():
            patched = load_car(found / case.name / "car.toml")
            errors["this engine"] = position_error(
                without_faults(again, patched.faults), patched, None
            )
    began = time.perf_counter()
    data = residuals(recording, car)
    top = float(abs(data.terms["sideways"][:, 0]).max())
    shared = time.perf_counter() - began
    for row, model in (("PySINDy as shipped", Sindy()),
                       ("PySINDy calibrated", sparse[recording.vehicle])):  # fmt: skip
        began = time.perf_counter()
        names = model.names(data)
        _named(table[row], label, names)
        if row == "PySINDy as shipped":
            _named(table["PySINDy, largest term"], label, names[:1])
        table[row]["seconds"].append(shared + time.perf_counter() - began)
        errors[row] = position_error(again, car, sindy_pushes(model.forces(data), top))
    began = time.perf_counter()
    gaussian = Gaussian().fit(data)
    table["Gaussian process"]["seconds"].append(shared + time.perf_counter() - began)
    errors["Gaussian process"] = position_error(again, car, gaussian_pushes(gaussian))
    for row, error in errors.items():
        table[row]["error"].append(error)
        table[row]["ratio"].append(error / errors["nominal car"])
    words = ", ".join(f"{row} {1000 * e:.1f} mm" for row, e in errors.items())
    print(f"{case.name} {'+'.join(label.names) or 'nothing'}: {words}", flush=True)


def _named(row, label, names):
    """Count what a peer named; a law that has no name cannot be right."""
    is_known = label.kind != "unlisted"
    exact = is_known and set(names) == set(label.names)
    among = is_known and set(label.names) <= set(names)
    _count(row, label, exact, among, bool(names))


def _count(row, label, exact, among, named):
    row["exact" if label.names else "healthy"].append(exact if label.names else named)
    if label.names:
        row["among"].append(among)


def _print(table):
    print(f"\n{'':24}{'exact':>9}{'among':>9}{'alarms':>9}{'error':>10}{'of nominal':>12}{'s':>8}")
    for name in ROWS:
        row = table[name]
        shares = [_share(row[key]) for key in ("exact", "among", "healthy")]
        error = f"{1000 * statistics.median(row['error']):.1f} mm" if row["error"] else "-"
        ratio = f"{statistics.median(row['ratio']):.2f}" if row["ratio"] else "-"
        took = f"{statistics.median(row['seconds']):.1f}" if row["seconds"] else "-"
        print(f"{name:24}" + "".join(f"{s:>9}" for s in shares)
              + f"{error:>10}{ratio:>12}{took:>8}")  # fmt: skip


def _share(values):
    return f"{sum(values)}/{len(values)}" if values else "-"
