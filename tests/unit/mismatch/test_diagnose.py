"""What a diagnosis says of the car as a whole."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from scm.mismatch.experiment.manoeuvres import MANOEUVRES, Floor, pace_of
from scm.mismatch.experiment.plan import Separation, place
from scm.mismatch.experiment.suggest import Suggestion, Weighed, drive_alone
from scm.mismatch.findings import Undecided, Verdict
from scm.mismatch.pipeline import write
from scm.mismatch.report.sentences import verdict_sentence
from scm.mismatch.select.round import Context
from scm.mismatch.validate.conclude import (
    Result,
    as_given,
    gained_nothing,
    verdict_of,
)
from scm.mismatch.validate.found_car import patched
from scm.mismatch.validate.free_runs import driven_in, stated_by, with_accuracy
from scm.vehicles.car import load_car
from tests.unit.mismatch import made_fit
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_drive import healthy_model, nigel


def suggested(name, between):
    """A drive as a search would suggest it."""
    model, floor = healthy_model(), Floor((-3.0, 3.0), (-3.0, 3.0))
    experiment = drive_alone(MANOEUVRES[name], name)
    leg = place(experiment.legs[0], model.car, pace_of(model.car, model.drives, floor), [{}])
    question = Undecided(between=between, drive_this=f"Drive {name}.", expected_separation=6.0)
    weighed = Weighed(
        experiment, (leg,), Separation(np.full((2, 2), 36.0), np.zeros((2, 2, 0)), ())
    )
    return Suggestion(question, weighed, (weighed,), floor)


def test_numbers_that_gained_nothing_on_unseen_parts_stay_as_the_file_has_them(tmp_path):
    assert gained_nothing(made_up.fit(before=0.018, after=0.0184))
    assert not gained_nothing(made_up.fit(before=0.018, after=0.0176))
    model, _, best = made_fit.healthy()
    context = Context(np.ones(len(model.t)), ())
    assert np.abs(best.z).max() > 0.0
    keys = [own.key for own in model.nominal if nigel().has(own.key)]

    def moved(fitted):
        car = patched(nigel(), fitted, tmp_path)
        return [key for key in keys if car.value(key) != nigel().value(key)]

    assert moved(best)
    given = as_given(context, best)
    assert moved(given) == []
    for key, value in given.numbers.items():
        text = 0.0 if key.startswith("clock.") else model.car.value(key)
        assert value == pytest.approx(text), key  # also what no car file says


def test_free_runs_far_beyond_noise_and_what_simulators_differ_by_are_a_mismatch_without_a_name():
    floor_m, runs = made_up.fit().confirm.noise_floor["position_m"], made_up.free_runs()
    nowhere = replace(runs, measured={k: np.zeros_like(v) for k, v in runs.measured.items()})

    def verdict(after_m, runs):
        return verdict_of((), (), made_up.fit(after=after_m), runs)

    assert verdict(3.1 * floor_m, nowhere) is Verdict.MISMATCH
    assert verdict(2.3 * floor_m, nowhere) is Verdict.NONE
    alike_m = 0.01 * driven_in(runs)["position_m"]
    assert alike_m == pytest.approx(0.01 * 1.33, rel=0.1)  # of the way in 3 s
    assert verdict(2.9 * np.hypot(floor_m, alike_m), runs) is Verdict.NONE
    assert verdict(3.1 * np.hypot(floor_m, alike_m), runs) is Verdict.MISMATCH


def test_a_car_as_accurate_as_its_file_states_strays_no_more_than_expected():
    fit, runs = made_up.fit(after=0.2), made_up.free_runs()
    stated = with_accuracy(nigel(), fit, runs)
    share = stated.value("accuracy.position_error")
    assert share == pytest.approx(0.2 / driven_in(runs)["position_m"])

    def verdict(after_m, car):
        fit = structs.replace(made_up.fit(after=after_m), stated=stated_by(car, runs))
        return verdict_of((), (), fit, runs)

    assert verdict(0.2, nigel()) is Verdict.MISMATCH
    assert verdict(0.29, stated) is Verdict.NONE
    assert verdict(0.31, stated) is Verdict.MISMATCH
    fit = structs.replace(fit, stated=stated_by(stated, runs))
    new = made_up.diagnosis(verdict=Verdict.NONE, effects=(), fit=fit)
    assert verdict_sentence(new).startswith("Nothing new: ")


def test_the_accuracy_of_a_car_found_is_in_its_file(tmp_path):
    fit, runs = made_up.fit(after=0.2), made_up.free_runs()
    found = made_up.diagnosis(fit=fit)
    evidence = made_up.evidence(free_runs=runs)
    for car, has in ((nigel().with_values({"body.mass_kg": 2.9}), True), (None, False)):
        write(Result(found, nigel(), evidence, found_car=car), tmp_path)
        assert load_car(tmp_path / "car.toml").has("accuracy.position_error") is has


def test_the_drives_of_two_open_questions_lie_side_by_side(tmp_path):
    suggestions = (
        suggested("circles", ("steer_gain", "understeer")),
        suggested("straight_steps", ("drive_gain", "motor_gain")),
    )
    found = made_up.diagnosis(
        verdict=Verdict.UNDECIDED, undecided=tuple(s.undecided for s in suggestions)
    )
    write(Result(found, nigel(), made_up.evidence(), suggestions=suggestions), tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for folder, name in (("next_drive", "circles"), ("next_drive_2", "straight_steps")):
        text = (tmp_path / folder / "next_drive.yaml").read_text(encoding="utf-8")
        assert f"Drive {name}." in text
        assert f"<code>{folder}</code>" in page
