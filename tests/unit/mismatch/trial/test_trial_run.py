"""A whole trial: labels stay sealed until all is said, and a changed one is told."""

import json
import math
import os

import pytest

import scm
from scm.errors import RecordingError, RunError
from scm.mismatch.findings import Diagnosis, Verdict
from scm.mismatch.trial import run
from scm.mismatch.trial.again import compare, error, true_cars
from scm.mismatch.trial.labels import Case, find_cases, label_of, open_label, read_seals
from scm.mismatch.trial.run import (
    answer_all,
    judged_again,
    on_own_cases,
    on_shipped_cases,
    processes,
)
from scm.recording.read import read_recordings
from scm.vehicles.car import load_car

NONE = Diagnosis(
    verdict=Verdict.NONE, located=(), effects=(), undecided=(), fit=None, runtime_s=0.5
)


def says_none(recording, out):
    """Find nothing, whatever is there."""
    assert (recording / "recording.yaml").is_file()
    return NONE


def breaks(recording, out):
    msg = "no idea"
    raise ValueError(msg)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Two healthy cases, diagnosed by somebody who never finds anything."""
    out = tmp_path_factory.mktemp("trial")
    request = run.CaseRequest(seed=11, cases=2, kind="none")
    heard = []
    lines = on_own_cases(request, out, says_none, notify=lambda *what: heard.append(what))
    return out, lines, heard


def test_a_trial_makes_diagnoses_and_judges_its_cases(made):
    out, lines, heard = made
    assert any(line.startswith("none") and "100 %" in line for line in lines)
    assert heard[0] == ("making cases", 0, 2)
    assert ("diagnosing", 0, 2) in heard
    assert heard[-1] == ("diagnosing", 2, 2)
    assert (out / "found" / "case_001" / "diagnosis.json").is_file()
    assert (out / "table.txt").read_text().splitlines() == lines


def test_kept_diagnoses_are_judged_again_alike(made):
    out, lines, _ = made
    assert judged_again(out) == lines


def test_drawn_families_of_one_half_come_to_the_table(tmp_path):
    request = run.CaseRequest(seed=11, cases=1, kind="none", family="drawn", half="judge")
    table = on_own_cases(request, tmp_path, says_none)
    assert any(line.startswith("step_hz 2000") and "100 %" in line for line in table)
    assert not any("two_cubics" in line for line in table)


def test_a_second_trial_in_the_same_place_is_refused(made):
    with pytest.raises(RecordingError, match="holds a trial already"):
        on_own_cases(run.CaseRequest(cases=1), made[0], says_none)


def test_a_label_changed_after_it_was_sealed_is_told(made, tmp_path):
    out, _, _ = made
    seals = read_seals(out)
    assert open_label(out, "case_000", seals["case_000"]).kind == "none"
    held = json.loads((out / "labels" / "case_000.json").read_text())
    held["label"]["names"] = ["wind"]
    (tmp_path / "labels").mkdir()
    (tmp_path / "labels" / "case_000.json").write_text(json.dumps(held))
    with pytest.raises(RecordingError, match="not what was sealed"):
        open_label(tmp_path, "case_000", seals["case_000"])


def test_cases_are_diagnosed_in_processes_of_their_own(made, tmp_path):
    cases = find_cases(made[0])
    with processes(2) as executor:
        answers = list(answer_all(cases, tmp_path, os.path.relpath, executor))
    said = {answer.case.name: answer.diagnosis for answer in answers}
    assert said == {case.name: os.path.relpath(case.drive, tmp_path / case.name) for case in cases}
    assert (tmp_path / "case_001" / "diagnosis.json").is_file()


def test_a_diagnosis_that_breaks_is_counted_and_not_hidden(made, tmp_path):
    case = find_cases(made[0])[0]
    (tmp_path / "case_000").symlink_to(case.drive.parent)
    label = {"names": ["wind"], "car": "nigel", "equation": "body", "depends_on": ["heading"],
             "parameters": {"force_x_n": 1.0, "force_y_n": 0.0}, "listed": True}  # fmt: skip
    (tmp_path / "labels.json").write_text(json.dumps({"case_000": label}))
    lines = on_shipped_cases(tmp_path, tmp_path / "out", breaks, ["000"])
    assert any("wind  ->  ValueError: no idea" in line for line in lines)
    assert "ValueError" in (tmp_path / "out" / "found" / "case_000" / "failed.txt").read_text()


def test_a_case_that_is_not_there_is_named(made):
    with pytest.raises(RecordingError, match="no case_077; there are 2 cases"):
        find_cases(made[0], ["077"])


def test_an_installed_package_says_that_it_has_no_reality(monkeypatch, tmp_path):
    (tmp_path / "scm").mkdir()
    monkeypatch.setattr(scm, "__file__", str(tmp_path / "scm" / "__init__.py"))
    with pytest.raises(RunError, match="from a clone"):
        run.find_root()


def label(names, parameters, car="nigel", **more):
    said = {"names": names, "car": car, "equation": "", "depends_on": [], "listed": True,
            "parameters": parameters, **more}  # fmt: skip
    return label_of("case_000", said)


def test_the_true_car_has_the_concealed_numbers():
    base = load_car("nigel").with_terms(["battery_sag"])
    truth = label(
        ["battery_sag", "wheel_radius"],
        [{"fraction_per_min": 0.1}, {"scale": 1.03}],
        ordinary={"body.mass_kg": 2.5},
    )
    (car,) = true_cars(base, truth)
    assert car.value("drive.sag_per_min") == 0.1
    assert car.value("wheel.radius_m") == pytest.approx(1.03 * 0.0325)
    assert car.value("body.mass_kg") == 2.5
    assert car.value("drive.axle_lock") == 1.0


def test_the_true_car_is_without_what_came_and_went():
    base = load_car("nigel").with_terms(["payload"])
    truth = label(["payload"], [{"mass_kg": 1.0}], kind="intermittent", since_s=30.0, until_s=52.0)
    (car,) = true_cars(base, truth)
    assert car.value("payload.mass_kg") == base.value("payload.mass_kg")


def test_a_law_outside_the_library_has_no_true_car():
    truth = label(["nap"], [{"force_n": 1.0}], listed=False)
    assert true_cars(load_car("nigel"), truth) == []


def test_without_a_patched_car_there_is_nothing_to_compare(made, tmp_path):
    case = find_cases(made[0])[0]
    assert compare(case, label(["payload"], [{"mass_kg": 1.0}]), tmp_path) is None


def test_faults_of_the_camera_are_undone_before_a_free_run(made):
    case = find_cases(made[0])[0]
    recording = read_recordings(case.again)[0]
    plain = load_car(recording.vehicle)
    tilted = plain.with_measures(["camera_tilt"], {"measure.camera_tilt_x_per_m": 0.1})
    assert error(recording, tilted) > 1.3 * error(recording, plain)
    nothing = plain.with_measures(["camera_tilt"], {})
    assert math.isclose(error(recording, nothing), error(recording, plain), rel_tol=1e-6)


def test_a_case_knows_its_two_drives(made):
    case = find_cases(made[0])[0]
    assert isinstance(case, Case)
    assert case.drive.name == "drive"
    assert case.again.name == "again"
