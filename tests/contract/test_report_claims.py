"""What a report says of a car is true of the car file beside it: `scm replay --report` agrees."""

import json
from dataclasses import replace

import numpy as np
import pytest

from scm.clock import WallClock
from scm.mismatch import budget
from scm.mismatch import usable_data as sample
from scm.mismatch.budget import Budget
from scm.mismatch.discovery import decide
from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.pipeline import diagnose_car, write
from scm.mismatch.select import selected
from scm.mismatch.validate.check_report import check_report
from scm.vehicles.car import load_car
from tests.unit.mismatch.made_drive import made_drive, nigel
from tests.unit.mismatch.test_budget import Batches

TRIM = (("steering.trim_rad", 0.06),)


def interrupted_after(batches):
    def made_with(_limit_s, clock):
        made = Batches(1.0, clock)
        made.left = batches
        return made

    return made_with


def late(name, _t, values):
    """Poses in a unit that is slightly wrong: the camera's metre is 1.05 of a metre."""
    return 1.05 * values if name in ("pose.x", "pose.y") else values


FEW = ("steer_trim", "pose_scale")  # what there is to choose from: all takes half a minute
CASES = {
    "2 s": (TRIM, None, {"budget_s": 2.0}),
    "a fault of the camera": ((), late, {"finds": "pose_scale"}),
    "interrupted at once": (TRIM, None, {"batches": 3}),
    "interrupted in a round": (TRIM, None, {"batches": 40}),
}


@pytest.mark.parametrize("case", CASES)
def test_every_figure_of_a_report_is_that_of_its_car_file(case, tmp_path, monkeypatch):
    numbers, sense, how = CASES[case]
    more = {} if sense is None else {"sense": sense}
    recording = made_drive(numbers, seconds=14.0, **more)
    made = Budget
    if "batches" in how:
        made = interrupted_after(how["batches"])
    if "finds" in how:
        few = [effect for effect in candidates(nigel()) if effect.name in FEW]
        monkeypatch.setattr(selected, "candidates", lambda _car: few)
        monkeypatch.setattr(decide, "explain", lambda _context, _unseen, _found: (False, None))
        monkeypatch.setattr(decide, "decide", lambda _context, found, _unseen: (found.best, None))
    limited = made(how.get("budget_s", 600.0), WallClock())
    found = diagnose_car([recording], nigel(), budget=limited)
    if "finds" in how:
        assert [effect.name for effect in found.diagnosis.effects] == [how["finds"]]
    assert_figures_are_the_car_file_s(found, recording, tmp_path)


@pytest.fixture(scope="module")
def untimed():
    """A drive, and what is found in it in no time."""
    recording = made_drive(TRIM, seconds=14.0)
    return recording, diagnose_car([recording], nigel(), budget=Budget(0.0, WallClock()))


def test_every_figure_of_a_report_made_in_no_time_is_that_of_its_car_file(untimed, tmp_path):
    recording, found = untimed
    assert_figures_are_the_car_file_s(found, recording, tmp_path)


def test_every_figure_of_a_recording_with_a_pause_of_a_day_is_that_of_its_car_file(tmp_path):
    recording = made_drive(TRIM, seconds=14.0)
    for name, channel in recording.channels.items():
        late = np.where(channel.t >= 6.0, channel.t + 86_400.0, channel.t)
        recording.channels[name] = replace(channel, t=late)
    found = diagnose_car([recording], nigel(), budget=Budget(0.0, WallClock()))
    write(found, tmp_path)
    figures = check_report(tmp_path, [recording])
    assert {figure.part for figure in figures} == {"fit", "choose", "confirm"}
    assert [figure for figure in figures if not figure.agrees] == []
    assert len(found.evidence.recordings) == 1


def test_every_figure_of_pieces_that_a_budget_allows_is_that_of_its_car_file(tmp_path, monkeypatch):
    monkeypatch.setattr(budget, "MIN_COMPARED_S", 10.0)
    monkeypatch.setattr(sample, "PIECE_S", 4.0)
    recording = made_drive(TRIM, seconds=14.0)
    found = diagnose_car([recording], nigel(), budget=Budget(0.0, WallClock()))
    assert "partly_compared" in {problem.name for problem in found.diagnosis.data}
    write(found, tmp_path)
    figures = check_report(tmp_path, [recording])
    assert figures
    assert [figure for figure in figures if not figure.agrees] == []


def assert_figures_are_the_car_file_s(found, recording, folder):
    """Check every figure and every number that the report shows against the file beside it."""
    write(found, folder)
    figures = check_report(folder, [recording])
    assert {figure.part for figure in figures} == {"fit", "choose", "confirm"}
    assert [figure for figure in figures if not figure.agrees] == []
    drawn = json.loads((folder / "drawn.json").read_text(encoding="utf-8"))
    car = load_car(folder / "car.toml")
    shown = [one for one in drawn["numbers"] if car.has(one["key"])]
    assert shown
    for one in shown:
        assert car.value(one["key"]) == pytest.approx(one["found"]["value"], rel=1e-3, abs=1e-9)


def test_a_figure_of_another_car_is_found_out(untimed, tmp_path):
    recording, found = untimed
    write(found, tmp_path)
    text = (tmp_path / "given.toml").read_text(encoding="utf-8")
    (tmp_path / "car.toml").write_text(text, encoding="utf-8")
    figures = check_report(tmp_path, [recording])
    assert any(not figure.agrees for figure in figures if figure.car == "car.toml")
