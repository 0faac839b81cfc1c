"""Cases conceal what their label says, and labels cannot be changed unseen."""

import json

import numpy as np
import pytest

from scm.vehicles.car import all_terms
from scm.vehicles.sensor_fault import all_sensor_faults
from tests.reality import cases
from tests.reality.cases import draw_kinds, make_case, names_for, seal, write_cases
from tests.reality.changing import Changing
from tests.reality.concealed import ALIKE, EFFECTS, LISTED
from tests.reality.motion import ROW_S
from tests.reality.numbers import nominal


def test_every_listed_name_and_parameter_is_one_of_the_librarys():
    for effect in LISTED:
        library = all_sensor_faults().get(effect.name) or all_terms()[effect.name]
        parts = [library, *getattr(library, "also", ())]
        names = {param.reported for part in parts for param in part.params}
        for car, smallest in effect.smallest.items():
            drawn = effect.draw(smallest, np.random.default_rng(0), car)
            assert set(drawn.parameters) <= names, effect.name


@pytest.fixture
def short(monkeypatch):
    """Let cases be drives of five seconds."""
    monkeypatch.setattr(cases, "DRIVES", (("drive", 5.0), ("again", 5.0)))


def test_what_comes_and_goes_is_there_between_its_two_moments_only(short):
    rng = np.random.default_rng(5)
    label, drives, numbers = make_case("intermittent", rng, names=("encoder_loss",), car="nigel")
    since, until, lost = label["since_s"], label["until_s"], label["parameters"][0]["fraction"]
    assert 1.0 <= since < until <= 4.5
    changing = Changing(nominal("nigel"), numbers | {"mass": 9.0}, since, since, until)
    times = (since - 0.01, since + 0.01, until - 0.01, until)
    assert [changing.at(t)["mass"] == 9.0 for t in times] == [False, True, True, False]
    found = []
    for drive in drives.values():
        t, left, right = drive.encoders.T
        counted = np.interp(t, drive.rows[:, 0], np.cumsum(np.abs(drive.rows[:, 4])) * ROW_S)
        share = np.gradient(left + right) / np.maximum(np.gradient(counted), 1e-6)
        moving = np.gradient(counted) > 0.5 * np.gradient(counted).max()
        there = (t > since + 0.1) & (t < until - 0.1)
        found += [np.median(share[moving & there]), np.median(share[moving & ~there])]
    there, before, *again = found
    assert [there, *again] == pytest.approx([(1 - lost) * before, before, before], rel=0.01)


def test_half_of_the_cars_are_not_quite_as_their_file_says(short):
    moved = [
        bool(make_case("none", np.random.default_rng(seed), car="nigel")[0]["ordinary"])
        for seed in range(12)
    ]
    assert 0 < sum(moved) < 12


def test_strengths_are_multiples_of_the_smallest_effect(short):
    rng = np.random.default_rng(2)
    label, _, numbers = make_case("single", rng, (2.0, 3.0), names=("steer_trim",), car="nigel")
    offset = abs(label["parameters"][0]["offset_rad"])
    assert 2.0 <= offset / EFFECTS["steer_trim"].smallest["nigel"] <= 3.0
    assert abs(numbers["trim"]) == offset
    assert nominal("nigel")["trim"] == 0.0


def test_both_drives_cross_a_patch():
    rng = np.random.default_rng(3)
    label, drives, _ = make_case("single", rng, names=("surface_patch",), car="nigel")
    spot = label["parameters"][0]
    for drive in drives.values():
        away = np.hypot(drive.rows[:, 1] - spot["x_m"], drive.rows[:, 2] - spot["y_m"])
        assert away.min() < 0.7 * spot["radius_m"]


def test_a_steering_stop_is_one_that_the_driver_reaches():
    rng = np.random.default_rng(3)
    label, drives, _ = make_case("single", rng, names=("steer_saturation",), car="nigel")
    stops = label["parameters"][0]
    for drive in drives.values():
        steering = drive.commands[:, 2]
        assert np.mean((steering > stops["left"]) | (steering < -stops["right"])) > 0.02


def test_a_seal_tells_a_changed_label_and_hides_the_true_one():
    label = {"names": ["wind"], "parameters": [{"force_x_n": 0.5}]}
    sealed = seal(label, "salt")
    assert seal(label | {"names": ["grade"]}, "salt") != sealed
    assert seal(label, "pepper") != sealed
    assert seal(json.loads(json.dumps(label)), "salt") == sealed


def test_a_case_is_the_same_however_many_there_are(short, tmp_path):
    write_cases(tmp_path / "one", 4, ["none"])
    write_cases(tmp_path / "two", 4, ["none", "none"])
    first, second = ((tmp_path / name / "sealed.txt").read_text() for name in ("one", "two"))
    assert second.startswith(first)


def test_controls_name_another_car_or_hold_another_drives_commands(short, tmp_path):
    write_cases(tmp_path, 4, ["other_car", "shuffled"])
    labels = [
        json.loads((tmp_path / "labels" / f"case_00{k}.json").read_text())["label"]
        for k in range(2)
    ]
    text = (tmp_path / "case_000" / "drive" / "recording.yaml").read_text()
    assert f"vehicle: {labels[0]['car']}" not in text
    text = (tmp_path / "case_001" / "drive" / "recording.yaml").read_text()
    assert f"vehicle: {labels[1]['car']}" in text
    assert [label["names"] for label in labels] == [[], []]


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_pairs_are_two_different_effects_that_can_be_told_apart(car):
    rng = np.random.default_rng(0)
    for _ in range(300):
        pair = set(names_for("pair", car, rng))
        assert len(pair) == 2
        assert pair not in ALIKE
        assert all(car in EFFECTS[name].smallest for name in pair)


def test_kinds_are_mixed_as_wished():
    assert draw_kinds("none", 3, 0) == ["none"] * 3
    assert {*draw_kinds("mixed", 60, 0)} == {"single", "none", "pair", "unlisted"}


@pytest.mark.parametrize("kind", ["single", "pair", "unlisted"])
def test_a_recording_says_nothing_of_what_is_concealed(kind, short, tmp_path):
    write_cases(tmp_path, 9, [kind])
    label = json.loads((tmp_path / "labels" / "case_000.json").read_text())["label"]
    for path in (tmp_path / "case_000").rglob("*.*"):
        text = path.read_text()
        assert not any(name in text for name in label["names"])
