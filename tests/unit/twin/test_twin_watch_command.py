"""`scm twin watch` in words."""

import re
from dataclasses import replace

import pytest

from scm.__main__ import main
from tests.unit.mismatch.made_drive import made_drive
from tests.unit.twin.test_watch import LASTS_S, biased


@pytest.fixture
def recorded(monkeypatch):
    def put(recording):
        monkeypatch.setattr("scm.recorder.drives.recordings_of", lambda *_: [recording])

    return put


def test_change_is_printed_with_when_and_what(recorded, capsys):
    recorded(made_drive(seconds=LASTS_S, sense=biased))
    assert main(["twin", "watch", "drive.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("drive.mcap: car nigel, driven for 29")
    assert "it changed once (in the first 600 s only plain changes are noticed)" in lines[0]
    assert re.match(r"  changed at 2(49|50|51)\.\d s \(", lines[1])
    assert "    as by gyro_bias (bias_rad_s +0.0" in lines[2]
    assert " rad/s)" in lines[2]


def test_change_of_one_car_of_two_is_its_own(monkeypatch, capsys):
    def earlier(name, t, values):
        return biased(name, t + 20.0, values)

    cars = [made_drive(seconds=LASTS_S, sense=earlier), made_drive(seconds=LASTS_S)]
    named = [replace(one, name=name) for one, name in zip(cars, ("n1", "n2"), strict=True)]
    monkeypatch.setattr("scm.recorder.drives.recordings_of", lambda *_: named)
    assert main(["twin", "watch", "drive.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines if "driven for" in line] == ["n1", "n2"]
    assert "    n1 itself changed: no other car that drove since did (car 100 %)" in lines


def test_short_recording_is_too_short_to_learn_from(root, capsys):
    assert main(["twin", "watch", str(root / "recordings" / "sample")]) == 0
    assert "too short, it takes 200 s to learn how it strays" in capsys.readouterr().out


@pytest.mark.parametrize("hours", ["0", "-1", "nan"])
def test_impossible_rate_of_false_alarms_is_refused(hours, capsys):
    assert main(["twin", "watch", "drive.mcap", "--false-alarm-h", hours]) == 2
    assert f"false_alarm_h: expected more than 0, got {hours}" in capsys.readouterr().err


def test_recording_that_is_not_there_is_named(tmp_path, capsys):
    assert main(["twin", "watch", str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in capsys.readouterr().err
