"""Which recordings are of one car, and what is written of several."""

import argparse
import json
import re
import shutil
from types import SimpleNamespace

import pytest

from scm.__main__ import main
from scm.commands import mismatch
from scm.mismatch.findings import Estimate, Undecided, Verdict
from scm.mismatch.report.cars_page import several_html, several_summary, write_several
from scm.mismatch.several.diagnose import _is_decided, cars_of
from scm.mismatch.several.findings import (
    Agreement,
    CarAgreement,
    Cause,
    Common,
    all_alike,
    conclusion,
)
from scm.vehicles.car import load_car
from tests.reality.several_cars import write_cars
from tests.unit.mismatch import made_up_findings as made_up


def seen(car, agreement=Agreement.CONFIRMS, value=0.03, *, alone=False):
    own = {"tilt_x": Estimate(value=value, low=value - 0.01, high=value + 0.01, unit="1/m")}
    return CarAgreement(
        car=car, agreement=agreement, alone=alone, gain=40.0, needed=8.0, misses=0.4, own=own
    )


def common(*cars, shared=True, cause=Cause.CAMERA):
    told = {"tilt_x": Estimate(value=0.03, low=0.025, high=0.035, unit="1/m")}
    return Common(
        name="camera_tilt", cause=cause, shared=shared, parameters=told, cars=cars,
        text="The camera looks askew.", conclusion=conclusion(cause, cars, shared=shared),
    )  # fmt: skip


@pytest.fixture
def two(tmp_path):
    write_cars(tmp_path / "two", 2, 3.0, lambda _: {})
    return tmp_path / "two"


def test_tables_with_vehicles_of_their_own_are_several_cars(two):
    assert list(cars_of([two])) == ["car_1", "car_2"]
    assert [len(recordings) for recordings in cars_of([two, two]).values()] == [2, 2]


def test_recordings_that_name_one_car_are_of_one(tmp_path):
    write_cars(tmp_path / "one", 1, 3.0, lambda _: {})
    cars = cars_of([tmp_path / "one", tmp_path / "one"])
    assert [len(recordings) for recordings in cars.values()] == [2]


def test_two_cars_of_one_name_get_folders_of_their_own(two, tmp_path):
    shutil.copytree(two, tmp_path / "again")
    assert list(cars_of([two, tmp_path / "again"])) == ["car_1", "car_2", "car_1_2", "car_2_2"]


def test_all_cars_are_diagnosed_each_into_its_own_folder(two, tmp_path, capsys):
    parser = argparse.ArgumentParser()
    mismatch.COMMAND.arguments(parser)
    out = tmp_path / "out"
    assert mismatch.COMMAND.run(parser.parse_args([str(two), "--out", str(out)])) == 0
    for car in ("car_1", "car_2"):
        assert json.loads((out / car / "report.json").read_text(encoding="utf-8"))["data"]
        assert load_car(str(out / car / "car.toml")).name == "nigel"
        assert f'href="{car}/report.html"' in (out / "report.html").read_text(encoding="utf-8")
    cars = json.loads((out / "cars.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in cars["cars"]] == ["car_1", "car_2"]
    assert cars["common"] == []
    assert "Nothing that the cars have in common was found." in capsys.readouterr().out


def test_a_car_that_cannot_be_diagnosed_does_not_stop_the_others(tmp_path, capsys):
    write_cars(tmp_path / "three", 3, 3.0, lambda _: {})
    (tmp_path / "three/car_2.toml").write_text("name = 3\n", encoding="utf-8")
    out = tmp_path / "out"
    assert main(["mismatch", str(tmp_path / "three"), "--out", str(out)]) == 0
    assert not (out / "car_2").exists()
    assert (out / "car_3/report.html").is_file()
    failed = json.loads((out / "cars.json").read_text(encoding="utf-8"))["failed"]
    assert len(failed) == 1
    assert "car_2.toml" in failed[0]
    assert f"scm mismatch: {failed[0]}" in capsys.readouterr().err
    assert "Not diagnosed: car_2: " in (out / "report.html").read_text(encoding="utf-8")


def test_the_page_says_each_verdict_and_what_is_common(tmp_path):
    cars = {"n1": made_up.diagnosis(), "n2": made_up.diagnosis(verdict=Verdict.NONE, effects=())}
    found = common(seen("n1", alone=True), seen("n2"))
    page = several_html(cars, {"n1": ("run",), "n2": ("run",)}, [found])
    first = page.partition("<section")[0]
    assert "The cars have in common: camera tilt." in first
    assert "Both cars see it alike: it is the camera, not the cars." in first
    assert "Nothing beyond noise" in first
    assert not re.search(r"(src|href)=.?https?:|<script|@import", page)
    write_several(cars, {"n1": ("run",), "n2": ("run",)}, [found], 3.0, tmp_path)
    fields = json.loads((tmp_path / "cars.json").read_text(encoding="utf-8"))
    assert fields["said"] == "The cars have in common: camera tilt."
    assert "Camera tilt: Both cars see it alike" in fields["conclusions"][0]
    told = fields["common"][0]
    assert told["shared"] is True
    assert told["cars"][1]["sight"] == "sees"
    assert "Both cars see it alike" in several_summary(cars, [found], tmp_path)


@pytest.mark.parametrize(
    ("cars", "shared", "says"),
    [
        (
            (seen("a"), seen("b"), seen("c", Agreement.UNDECIDED)), True,
            "a and b see it alike: it is the camera, not the cars. The drive of c cannot tell",
        ),
        (
            (seen("a"), seen("b"), seen("c", Agreement.CONTRADICTS)), True,
            "a and b see it alike, c would have to and does not: it is something that only a and b",
        ),
        (
            (seen("a", alone=True), seen("b", Agreement.UNDECIDED)), False,
            "Only a sees it; the drive of b cannot tell whether it is the camera",
        ),
        (
            (seen("a"), seen("b", Agreement.SUPPORTS), seen("c", Agreement.SUPPORTS)), True,
            "Too weak for one car alone, all 3 cars together show it: it is the camera",
        ),
    ],
)  # fmt: skip
def test_whose_it_is_in_words(cars, shared, says):
    assert conclusion(Cause.CAMERA, cars, shared=shared).startswith(says)


def asked(**criteria):
    """A car whose search ranked effects so, the lower the better."""
    rivals = tuple(SimpleNamespace(names=(name,)) for name in criteria)
    step = SimpleNamespace(alternatives=rivals, criteria=tuple(criteria.values()))
    return SimpleNamespace(selected=SimpleNamespace(selection=SimpleNamespace(rounds=[step])))


@pytest.mark.parametrize(
    ("between", "of_b", "decided"),
    [
        (("camera_tilt", "steer_trim"), {"camera_tilt": 0.0}, True),
        (("camera_tilt", "pose_scale"), {"camera_tilt": 0.0, "pose_scale": 30.0}, True),
        (("camera_tilt", "pose_scale"), {"camera_tilt": 0.0, "pose_scale": 3.0}, False),
        (("grade", "wind"), {"camera_tilt": 0.0}, False),
    ],
)
def test_other_cars_decide_what_one_leaves_open(between, of_b, decided):
    tilt = common(seen("a"), seen("b"))
    cars = {"a": asked(camera_tilt=0.0, pose_scale=1.0), "b": asked(**of_b)}
    question = Undecided(between=between, drive_this="", expected_separation=0.0)
    assert _is_decided(question, {"camera_tilt": tilt}, cars) is decided


def test_a_car_s_report_says_with_whom_it_shares_an_effect():
    tilt = common(seen("a", alone=True), seen("b"), seen("c", Agreement.UNDECIDED))
    assert all_alike(tilt, "a") == "Estimated together with b, seen by the same camera."
    assert "This car alone would not have shown it" in all_alike(tilt, "b")
