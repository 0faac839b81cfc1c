"""A written drive is played with a car, recorded, and the recording replays the same car."""

from pathlib import Path

import pytest

from scm.__main__ import main
from scm.errors import RunError, ScmError
from scm.fleet import LockstepLink
from scm.lockstep import Lockstep
from scm.maps.load import load_map
from scm.play import play, read_drive, write_recording
from scm.recording.read import read_recordings
from scm.replay import free_run
from scm.vehicles.car import load_car
from scm.world.part import WorldPart

ROWS = [(0.05 * k, 0.6 if 4 < k < 60 else 0.0, 0.3 if k > 20 else 0.0) for k in range(80)]


@pytest.fixture
def link():
    world = WorldPart(load_map("parking_school"), hosted=(("n1", "nigel"),))
    with Lockstep([world]) as lockstep:
        lockstep.run_for(0.1)
        yield LockstepLink(lockstep)


def test_what_is_played_is_recorded_so_that_the_same_car_replays_it(link, tmp_path):
    write_recording(play(link, "n1", ROWS), "nigel", tmp_path)
    (recording,) = read_recordings(tmp_path)
    run = free_run(recording, load_car("nigel"), horizon_s=1.0)
    assert recording.channel("pose.x").values.max() > recording.channel("pose.x").values[0] + 0.1
    assert run.position_error()[:, -1].max() < 0.005


def test_a_car_that_is_not_there_is_said(link):
    with pytest.raises(RunError, match="n7: its lease was not granted"):
        play(link, "n7", ROWS[:2])


def test_a_drive_with_an_unknown_key_is_refused_with_file_and_key(tmp_path):
    path = tmp_path / "drive.yaml"
    path.write_text("drive: 1\ncommands: a.csv\nfloor: 3\n", encoding="utf-8")
    with pytest.raises(ScmError, match=r"drive\.yaml.*floor"):
        read_drive(path)


def test_a_drive_played_with_a_car_file_names_it_from_where_the_recording_lies(tmp_path):
    (tmp_path / "cars").mkdir()
    own = load_car("nigel").path.read_text(encoding="utf-8")
    (tmp_path / "cars" / "mine.toml").write_text(own, encoding="utf-8")
    (tmp_path / "a.csv").write_text("t_s,throttle,steering\n0,0,0\n0.5,0.6,0\n1.5,0,0\n", "utf-8")
    text = "drive: 1\ncar: cars/mine.toml\nmap: parking_school\ncommands: a.csv\n"
    (tmp_path / "drive.yaml").write_text(text, encoding="utf-8")
    out = tmp_path / "far" / "away"
    assert main(["play", str(tmp_path / "drive.yaml"), "--out", str(out)]) == 0
    (recording,) = read_recordings(out)
    assert Path(recording.vehicle).samefile(tmp_path / "cars" / "mine.toml")


def test_a_command_is_held_for_as_long_as_the_table_says(link):
    played = play(link, "n1", [(0.0, 0.6, 0.0), (2.0, 0.0, 0.0)])
    assert len(played.commands) == 41
    assert played.poses[-1][1] - played.poses[0][1] > 0.2


@pytest.mark.parametrize("rows", ["", "1,0,0\n0,0,0\n", "0,nan,0\n"])
def test_a_table_without_a_course_of_time_is_refused(tmp_path, rows):
    (tmp_path / "a.csv").write_text(f"t_s,throttle,steering\n{rows}", encoding="utf-8")
    (tmp_path / "drive.yaml").write_text("drive: 1\ncommands: a.csv\n", encoding="utf-8")
    with pytest.raises(ScmError, match=r"a\.csv"):
        read_drive(tmp_path / "drive.yaml")
