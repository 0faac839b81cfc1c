"""A recording is cut where poses or commands are missing for long, and nowhere else."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scm.arrays import Floats
from scm.data_quality.check import check
from scm.data_quality.pose_track import grid, long_gaps, track
from scm.data_quality.prepare import prepare, stretches
from scm.data_quality.quality import Quality
from scm.data_quality.repairs import forward_speed
from scm.recording.read import Recording
from scm.recording.scans import Scans
from scm.recording.span import part_of
from scm.vehicles.car import Car

Drive = Callable[[int], Recording]

DAY_S = 86_400.0
SINCE_1970_S = 1.7e9
COMMANDS = ("command.throttle", "command.steering")


def paused(recording: Recording, at_s: float, for_s: float, only: str = "") -> Recording:
    """Return a recording whose stamps from one moment on are later."""
    channels = {
        name: replace(c, t=np.where(c.t >= at_s, c.t + for_s, c.t)) if name.startswith(only) else c
        for name, c in recording.channels.items()
    }
    return replace(recording, channels=channels)


def without(recording: Recording, prefix: str, first_s: float, last_s: float) -> Recording:
    """Return a recording in which some channels lack the rows between two moments."""
    channels = dict(recording.channels)
    for name, c in recording.channels.items():
        if name.startswith(prefix):
            keep = (c.t <= first_s) | (c.t >= last_s)
            channels[name] = replace(c, t=c.t[keep], values=c.values[keep])
    return replace(recording, channels=channels)


def spans(parts: tuple[Recording, ...], name: str) -> list[tuple[float, float]]:
    return [(float(p.channel(name).t[0]), float(p.channel(name).t[-1])) for p in parts]


def test_a_recording_without_gaps_is_one_stretch_bit_for_bit(drive: Drive, nigel: Car) -> None:
    found = stretches(drive(0), nigel)
    assert found.recordings == (drive(0),)
    assert found.recordings[0] is drive(0)
    assert not found.problems


@pytest.mark.parametrize("pause_s", [2.5, 300.0, 3600.0, DAY_S, 1.7e9])
def test_a_pause_of_all_tables_cuts_them_together(drive: Drive, nigel: Car, pause_s: float) -> None:
    found = stretches(paused(drive(0), 40.0, pause_s), nigel)
    assert len(found.recordings) == 2
    for name, channel in drive(0).channels.items():
        first, second = (part.channel(name) for part in found.recordings)
        assert np.array_equal(first.values, channel.values[channel.t < 40.0]), name
        after = second.values[second.t >= 40.0 + pause_s]
        assert np.array_equal(after, channel.values[channel.t >= 40.0]), name
    (problem,) = found.problems
    assert problem.name == "gap"
    assert "2 stretches" in problem.text
    assert "Left out" not in problem.text


def test_scans_are_cut_with_the_rest(drive: Drive, nigel: Car) -> None:
    recording = paused(drive(), 6.0, 600.0)
    t = recording.channel("pose.x").t
    one = np.ones(len(t))
    scans = Scans(t=t, ranges=t[:, None], angle_min=one, angle_increment=one, time_increment=one,
                  range_min=one, range_max=one)  # fmt: skip
    parts = stretches(replace(recording, scans=scans), nigel).recordings
    assert [part.scans.t.tolist() for part in parts if part.scans] == [
        part.channel("pose.x").t.tolist() for part in parts
    ]
    assert len(parts) == 2


def test_a_pause_of_less_than_two_seconds_is_bridged(drive: Drive, nigel: Car) -> None:
    shorter = without(drive(0), "pose.", 40.0, 41.5)
    assert stretches(shorter, nigel).recordings == (shorter,)


def test_ten_gaps_make_eleven_stretches(drive: Drive, nigel: Car) -> None:
    recording = drive(0)
    for k in range(10):
        recording = paused(recording, 6.0 + 6.5 * k + 100.0 * k, 100.0)
    assert len(stretches(recording, nigel).recordings) == 11


@pytest.mark.parametrize("prefix", ["pose.", "pose.x", "command.", "command.steering"])
def test_a_gap_of_what_a_replay_needs_cuts_all_tables(
    drive: Drive, nigel: Car, prefix: str
) -> None:
    found = stretches(without(drive(0), prefix, 30.0, 40.0), nigel)
    ends = spans(found.recordings, "imu.gyro_z")
    assert len(ends) == 2
    assert ends[0][1] == pytest.approx(31.0, abs=0.1)
    assert ends[1][0] == pytest.approx(39.0, abs=0.1)


@pytest.mark.parametrize("prefix", ["imu.", "encoder.", "encoder.left"])
def test_other_sensors_may_pause(drive: Drive, nigel: Car, prefix: str) -> None:
    paused_sensor = without(drive(0), prefix, 30.0, 40.0)
    assert stretches(paused_sensor, nigel).recordings == (paused_sensor,)


def test_commands_that_led_to_a_stretch_stay_with_it(drive: Drive, nigel: Car) -> None:
    second = stretches(without(drive(0), "pose.", 30.0, 40.0), nigel).recordings[1]
    first_s = second.channel("command.steering").t[0]
    assert 36.9 < first_s < 37.2


def test_commands_written_when_they_change_do_not_cut(drive: Drive, nigel: Car) -> None:
    rng = np.random.default_rng(3)
    channels = dict(drive(0).channels)
    for name in COMMANDS:
        c = channels[name]
        at = np.cumsum(rng.exponential(1.5, size=60))
        rows = np.unique(np.searchsorted(c.t, at[at < 74.0]))
        channels[name] = replace(c, t=c.t[rows], values=c.values[rows])
    recording = replace(drive(0), channels=channels)
    assert stretches(recording, nigel).recordings == (recording,)


def test_a_held_command_reaches_into_the_next_stretch(drive: Drive, nigel: Car) -> None:
    channels = dict(drive(0).channels)
    for name in COMMANDS:
        c = channels[name]
        rows = np.searchsorted(c.t, np.arange(1.0, 74.0, 7.0))
        channels[name] = replace(c, t=c.t[rows], values=c.values[rows])
    slow = without(replace(drive(0), channels=channels), "pose.", 30.5, 42.0)
    second = stretches(slow, nigel).recordings[1]
    assert second.channel("command.throttle").t[0] == pytest.approx(36.0, abs=0.1)


def test_slow_poses_are_not_cut_at_every_row(drive: Drive, nigel: Car) -> None:
    channels = dict(drive(0).channels)
    for name in ("pose.x", "pose.y", "pose.yaw"):
        c = channels[name]
        channels[name] = replace(c, t=c.t[::75], values=c.values[::75])
    slow = replace(drive(0), channels=channels)
    assert stretches(slow, nigel).recordings == (slow,)


def test_short_rest_is_left_out_and_its_rows_are_counted(drive: Drive, nigel: Car) -> None:
    cut = paused(paused(drive(0), 40.0, 60.0), 101.0, 60.0)
    found = stretches(cut, nigel)
    assert len(found.recordings) == 2
    (problem,) = found.problems
    t = cut.channel("pose.x").t
    left, of = int(((t > 99.0) & (t < 102.0)).sum()), len(t)
    assert f"{left} of {of} rows of pose.*" in problem.text
    assert len(problem.when_s or ()) == 2


def test_a_table_whose_second_half_is_a_day_late_is_left_out_there(
    drive: Drive, nigel: Car
) -> None:
    found = stretches(paused(drive(0), 40.0, DAY_S, only="command."), nigel)
    assert spans(found.recordings, "pose.x")[0][1] == pytest.approx(41.0, abs=0.1)
    assert len(found.recordings) == 1
    assert "rows of pose.*" in found.problems[0].text
    assert "rows of command.*" in found.problems[0].text


def test_a_recording_that_cannot_be_driven_stays_whole(drive: Drive, nigel: Car) -> None:
    channels = {n: c for n, c in drive(0).channels.items() if n != "command.throttle"}
    recording = replace(paused(drive(0), 40.0, DAY_S), channels=channels)
    assert stretches(recording, nigel).recordings == (recording,)


def test_cutting_costs_as_much_as_there_are_rows(drive: Drive, nigel: Car) -> None:
    def rows(parts: tuple[Recording, ...]) -> int:
        return sum(len(c.t) for part in parts for c in part.channels.values())

    whole: Floats = np.array([rows(stretches(drive(0), nigel).recordings)])
    cut = rows(stretches(paused(drive(0), 40.0, DAY_S), nigel).recordings)
    assert whole[0] <= cut <= whole[0] + 2


def faults(found: Quality) -> set[str]:
    return {suspicion.name for suspicion in found.suspicions} | {p.name for p in found.problems}


@pytest.mark.parametrize("pause_s", [2.5, 300.0, DAY_S, SINCE_1970_S])
def test_a_pause_makes_no_sensor_wrong(drive: Drive, nigel: Car, pause_s: float) -> None:
    found = check(paused(drive(0), 40.0, pause_s), nigel)
    assert faults(found) - faults(check(drive(0), nigel)) == {"gap"}
    assert found.usable.can_diagnose


def test_ten_pauses_make_no_sensor_wrong(drive: Drive, nigel: Car) -> None:
    recording = drive(0)
    for k in range(10):
        recording = paused(recording, 6.0 + 106.5 * k, 100.0)
    assert faults(check(recording, nigel)) - faults(check(drive(0), nigel)) == {"gap"}


@pytest.mark.parametrize("prefix", ["imu.", "encoder."])
def test_a_sensor_that_pauses_is_not_made_wrong(drive: Drive, nigel: Car, prefix: str) -> None:
    found = check(without(drive(0), prefix, 30.0, 40.0), nigel)
    assert faults(found) - faults(check(drive(0), nigel)) == {"gap"}


def test_a_stray_stamp_at_zero_costs_one_row(drive: Drive, nigel: Car) -> None:
    recording = paused(drive(0), 0.0, SINCE_1970_S)
    for name, c in recording.channels.items():
        if name.startswith("pose."):
            recording.channels[name] = replace(c, t=np.concatenate(([0.0], c.t[1:])))
    found = prepare(recording, nigel)
    (part,) = found.recordings
    assert len(part.channel("pose.x").t) == len(drive(0).channel("pose.x").t) - 1


def test_prepare_says_once_that_a_recording_pauses(drive: Drive, nigel: Car) -> None:
    found = prepare(paused(drive(0), 40.0, DAY_S), nigel)
    assert len(found.recordings) == 2
    assert [p.name for p in found.problems] == ["gap"]


def test_commands_of_another_clock_are_named_as_such(drive: Drive, nigel: Car) -> None:
    recording = paused(drive(0), 0.0, SINCE_1970_S, only="pose.")
    own = {n: c for n, c in recording.channels.items() if n.startswith(("pose.", "command."))}
    found = check(replace(recording, channels=own), nigel)
    said = {p.name: p.text for p in found.problems if p.channel.startswith("command.")}
    assert "share no time" in said["clock"]
    assert "without_effect" not in said


def test_a_grid_has_as_many_points_as_there_are_rows(drive: Drive) -> None:
    poses, late = track(drive(0)), track(paused(drive(0), 40.0, DAY_S))
    assert poses is not None
    assert late is not None
    whole = grid(poses.t[0], poses.t[-1], 0.02, 0.1, long_gaps(poses.t))
    cut = grid(late.t[0], late.t[-1], 0.02, 0.1, long_gaps(late.t))
    assert abs(len(whole.t) - len(cut.t)) <= 2
    assert len(cut.starts) == 2
    assert cut.length_s == pytest.approx(whole.length_s, abs=0.1)


def test_speeds_beside_a_pause_are_those_without_it(drive: Drive) -> None:
    cut, whole = (forward_speed(track(r)) for r in (paused(drive(0), 40.0, DAY_S), drive(0)))
    assert cut is not None
    assert whole is not None
    t = cut.t - np.where(cut.t > 40.0, DAY_S, 0.0)
    assert float(np.abs(cut.values - whole.at(t)).max()) < 0.05


def test_a_pause_does_not_make_a_drive_long_enough(drive: Drive, nigel: Car) -> None:
    short = part_of(drive(0), 20.0, 24.0)
    found = check(paused(short, 22.1, DAY_S), nigel)
    assert not found.usable.can_diagnose
    assert not found.relations


@pytest.mark.parametrize("seed", [0, 1])
def test_pauses_anywhere_and_of_any_length_make_no_sensor_wrong(
    drive: Drive, nigel: Car, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    short = part_of(drive(0), 0.0, 35.0)  # of which a clock's drift shows least
    recording = short
    for _ in range(3):
        recording = paused(recording, rng.uniform(3.0, 30.0), 10.0 ** rng.uniform(0.4, 7.0))
    found = check(recording, nigel)
    assert faults(found) - faults(check(short, nigel)) == {"gap"}
    assert found.usable.can_diagnose


def test_a_pause_of_a_day_is_no_drift_of_a_clock(drive: Drive, nigel: Car) -> None:
    short = part_of(drive(0), 0.0, 40.0)
    late = {r.pair: r.numbers["delay"] for r in check(paused(short, 18.0, DAY_S), nigel).relations}
    for relation in check(short, nigel).relations:
        if "delay" in relation.numbers:
            own = relation.numbers["delay"]
            assert abs(late[relation.pair].value - own.value) < 5.0 * own.std + 2e-3
