"""A written drive is played with a car, recorded, and the recording replays the same car."""

from pathlib import Path

import numpy as np
import pytest

from scm.__main__ import main
from scm.errors import RunError, ScmError
from scm.fleet import LockstepLink
from scm.maps.load import load_map
from scm.recorder.play import left_out, play, read_drive, write_recording
from scm.recording.read import read_recordings
from scm.replay.free_run import free_run
from scm.runtime.lockstep import Lockstep
from scm.v2x.mailbox import Mailbox
from scm.vehicles.car import load_car
from scm.world.part import WorldPart

ROWS = [(0.05 * k, 0.6 if 4 < k < 60 else 0.0, 0.3 if k > 20 else 0.0) for k in range(80)]


@pytest.fixture
def lockstep():
    world = WorldPart(load_map("parking_school"), hosted=(("n1", "nigel"),))
    with Lockstep([world]) as city:
        city.run_for(0.1)
        yield city


@pytest.fixture
def link(lockstep):
    return LockstepLink(lockstep)


def test_what_is_played_is_recorded_so_that_the_same_car_replays_it(link, tmp_path):
    write_recording(play(link, "n1", ROWS), "nigel", tmp_path)
    (recording,) = read_recordings(tmp_path)
    run = free_run(recording, load_car("nigel"), horizon_s=1.0)
    assert recording.channel("pose.x").values.max() > recording.channel("pose.x").values[0] + 0.1
    # a window that starts as the car brakes: smoothed poses blur the moment by some milliseconds
    assert run.position_error()[:, -1].max() < 0.004


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
    assert len(played.messages.commands) == 41
    assert played.messages.reports[-1].x_m - played.messages.reports[0].x_m > 0.2


def test_where_the_servo_stood_before_the_drive_is_recorded_too(link, tmp_path):
    rows = [(t, 0.4, -0.9 if t < 2.0 else 0.9) for t, _, _ in ROWS]
    write_recording(play(link, "n1", rows), "nigel", tmp_path)
    (recording,) = read_recordings(tmp_path)
    assert recording.channel("command.steering").values[0] == 0.0
    run = free_run(recording, load_car("nigel"), horizon_s=0.5)
    assert run.yaw_error()[0, -1] < 0.002, "a servo that began at its stop is 0.1 off"


class Through(LockstepLink):
    """A link that receives into mailboxes of a test's own."""

    def __init__(self, lockstep, mailbox):
        super().__init__(lockstep)
        self.bus, self.mailbox = lockstep.bus, mailbox

    def subscribe(self, subscription):
        box = self.mailbox()
        self.bus.subscribe(subscription.kind, subscription.where, box)
        return box


class Leaky(Mailbox):
    """Loses every tenth message, as a bad link does."""

    count = 0

    def put_later(self, make):
        self.count += 1
        if self.count % 10:
            super().put_later(make)


def test_a_drive_longer_than_a_mailbox_is_recorded_whole(lockstep, tmp_path):
    played = play(Through(lockstep, lambda: Mailbox(20)), "n1", ROWS)
    recording = write_recording(played, "nigel", tmp_path)
    t = recording.channel("pose.x").t
    assert t[-1] - t[0] == pytest.approx(ROWS[-1][0], abs=0.05)
    assert np.diff(t).max() < 0.021
    assert len(recording.channel("imu.gyro_z").t) == len(t)
    assert left_out(played, recording) == []


def test_what_was_lost_on_the_way_is_said(lockstep, tmp_path):
    played = play(Through(lockstep, lambda: Leaky(1000)), "n1", ROWS)
    (said,) = left_out(played, write_recording(played, "nigel", tmp_path))
    lost = int(said.partition(" messages of the car were lost")[0])
    assert lost == pytest.approx((1.0 + ROWS[-1][0]) * 50 / 10, abs=2)


def test_commands_that_came_late_are_recorded_as_they_were_obeyed(lockstep, tmp_path):
    class Slow(LockstepLink):
        def publish(self, message):
            if not 30 < message.seq < 45:
                super().publish(message)

    played = play(Slow(lockstep), "n1", ROWS)
    recording = write_recording(played, "nigel", tmp_path)
    (said,) = left_out(played, recording)
    assert "did not obey, for commands came late" in said
    throttle = recording.channel("command.throttle")
    began = recording.channel("pose.x").t[0]
    late = (throttle.t > began + 1.9) & (throttle.t < began + 2.1)
    assert not throttle.values[late].any(), "the guard had let go"
    (again,) = read_recordings(tmp_path)
    assert free_run(again, load_car("nigel"), horizon_s=1.0).position_error()[:, -1].max() < 0.001


def test_poses_about_a_hit_are_left_out_and_that_is_said(link, tmp_path):
    played = play(link, "n1", [(0.0, -0.6, 0.0), (3.0, 0.0, 0.0)])
    recording = write_recording(played, "nigel", tmp_path)
    assert len(recording.channel("pose.x").t) < 100
    said = left_out(played, recording)
    assert any("poses are left out: the car hit something" in sentence for sentence in said)


@pytest.mark.parametrize("rows", ["", "1,0,0\n0,0,0\n", "0,nan,0\n"])
def test_a_table_without_a_course_of_time_is_refused(tmp_path, rows):
    (tmp_path / "a.csv").write_text(f"t_s,throttle,steering\n{rows}", encoding="utf-8")
    (tmp_path / "drive.yaml").write_text("drive: 1\ncommands: a.csv\n", encoding="utf-8")
    with pytest.raises(ScmError, match=r"none\.yaml: cannot be read: No such file"):
        read_drive(tmp_path / "none.yaml")
    with pytest.raises(ScmError, match=r"a\.csv"):
        read_drive(tmp_path / "drive.yaml")


def test_a_car_of_a_running_city_is_refused_where_no_city_is_named(tmp_path, capsys):
    drive = str(tmp_path / "drive.yaml")
    assert main(["play", drive, "--vehicle", "n3"]) != 0
    assert "--vehicle n3: only a running city has such a car" in capsys.readouterr().err
