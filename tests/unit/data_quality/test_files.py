"""Files that are broken, incomplete or of another drive: each says so, and none raises."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scm.arrays import Floats
from scm.data_quality.check import check
from scm.data_quality.prepare import Prepared, prepare
from scm.data_quality.quality import Quality
from scm.recording.read import Recording
from scm.vehicles.car import Car, load_car

Drive = Callable[[int], Recording]
Change = Callable[[Floats, Floats], tuple[Floats, Floats]]

POSE = ("pose.x", "pose.y", "pose.yaw")
IMU = ("imu.accel_x", "imu.accel_y", "imu.gyro_z")
COMMANDS = ("command.throttle", "command.steering")


def changed(recording: Recording, names: tuple[str, ...], change: Change) -> Recording:
    channels = dict(recording.channels)
    for name in names:
        t, values = change(channels[name].t.copy(), channels[name].values.copy())
        channels[name] = replace(channels[name], t=t, values=values)
    return replace(recording, channels=channels)


def without(recording: Recording, *names: str) -> Recording:
    kept = {name: c for name, c in recording.channels.items() if name not in names}
    return replace(recording, channels=kept)


def said(found: Quality | Prepared) -> set[tuple[str, str]]:
    return {(name, p.name) for p in found.problems for name in p.channel.split(", ")}


def holes(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    values[100:130] = np.nan
    return t, values


def reset(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    t[len(t) // 3 :] -= 15.0
    return t, values


def backwards(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    t[500] -= 0.2
    return t, values


def frozen(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    still = (t > 20.0) & (t < 24.0)
    values[still] = values[still][0]
    return t, values


def gap(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    keep = (t < 40.0) | (t > 43.0)
    return t[keep], values[keep]


def glitch(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    values[700:704] += 1.5
    return t, values


def slow_sensor(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    return t, values[np.arange(len(values)) // 10 * 10]


def jitter(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    return t + np.where(np.arange(len(t)) % 2 == 0, 0.6, 0.0) / 30.0 * 1.6, values


def late(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    kept = np.arange(len(t)) % 12 != 5
    kept &= np.arange(len(t)) % 12 != 6
    return t[kept], values[kept]


def rounded(t: Floats, values: Floats) -> tuple[Floats, Floats]:
    return t, np.round(values / 0.05) * 0.05


BROKEN = [
    (("pose.x",), holes, ("pose.x", "not_finite")),
    (POSE, reset, ("pose.*", "time_backwards")),
    (POSE, backwards, ("pose.*", "time_backwards")),
    (("imu.gyro_z",), frozen, ("imu.gyro_z", "frozen")),
    (POSE, frozen, ("pose.x", "frozen")),
    (("encoder.left", "encoder.right"), frozen, ("encoder.left", "frozen")),
    (POSE, gap, ("pose.*", "gap")),
    (("pose.x",), glitch, ("pose.*", "spike")),
    (IMU, slow_sensor, ("imu.*", "held")),
    (("imu.gyro_z",), rounded, ("imu.gyro_z", "coarse")),
]


@pytest.mark.parametrize(("names", "change", "problem"), BROKEN)
def test_a_broken_channel_is_named(
    drive: Drive, nigel: Car, names: tuple[str, ...], change: Change, problem: tuple[str, str]
) -> None:
    assert problem in said(prepare(changed(drive(0), names, change), nigel))


@pytest.mark.parametrize(("names", "change", "problem"), BROKEN)
def test_a_broken_channel_makes_no_sensor_suspicious(
    drive: Drive, nigel: Car, names: tuple[str, ...], change: Change, problem: tuple[str, str]
) -> None:
    del problem
    found = prepare(changed(drive(1), names, change), nigel).quality.suspicions
    assert [suspicion for suspicion in found if not suspicion.repaired] == []


def test_a_gap_and_uneven_rows_are_said_in_words(drive: Drive, nigel: Car) -> None:
    def words(change: Change, name: str) -> str:
        found = check(changed(drive(0), POSE, change), nigel).problems
        return next(one.text for one in found if one.name == name)

    assert re.fullmatch(r"One gap of \d\.\d\d s in \d+\.\d s\.", words(gap, "gap"))
    assert re.fullmatch(
        r"Rows come every \d+\.\d ms as a rule, but one in twenty only after \d+ ms or more\.",
        words(late, "jitter"),
    )


@pytest.mark.parametrize(("change", "end_s"), [(frozen, 20.0), (gap, 40.0)])
def test_a_bad_stretch_is_no_part_of_what_can_be_used(
    drive: Drive, nigel: Car, change: Change, end_s: float
) -> None:
    spans = check(changed(drive(0), POSE, change), nigel).usable.spans["pose.x"]
    assert spans[0][1] == pytest.approx(end_s, abs=0.1)


def test_a_copy_of_a_channel_counts_once(drive: Drive, nigel: Car) -> None:
    true = drive(0)
    copied = replace(true, channels={**true.channels, "yaw_rate": true.channels["imu.gyro_z"]})
    found = check(copied, nigel)
    assert ("yaw_rate", "copied") in said(found)
    assert [relation.pair[1] for relation in found.relations].count("yaw_rate") == 0


def test_a_speed_computed_from_the_poses_is_no_witness(drive: Drive, nigel: Car) -> None:
    true = drive(0)
    x, y = true.channels["pose.x"], true.channels["pose.y"]
    speed = np.hypot(np.gradient(x.values, x.t), np.gradient(y.values, y.t))
    made = replace(x, values=speed, dimension="speed")
    found = check(replace(true, channels={**true.channels, "speed": made}), nigel)
    assert ("speed", "derived") in said(found)


def test_without_commands_sensors_are_compared_and_no_drive_is_judged(
    drive: Drive, nigel: Car
) -> None:
    found = check(without(drive(0), *COMMANDS), nigel)
    assert {("command.throttle", "missing"), ("command.steering", "missing")} <= said(found)
    assert not found.usable.can_diagnose
    assert len(found.relations) == 3


@pytest.mark.parametrize("missing", [POSE, ("pose.yaw",)])
def test_without_a_whole_pose_nothing_can_be_diagnosed(
    drive: Drive, nigel: Car, missing: tuple[str, ...]
) -> None:
    found = check(without(drive(0), *missing), nigel)
    assert "missing" in {problem.name for problem in found.problems}
    assert not found.usable.can_diagnose
    assert found.suspicions == ()


def test_three_seconds_are_too_short_for_anything(drive: Drive, nigel: Car) -> None:
    def short(t: Floats, values: Floats) -> tuple[Floats, Floats]:
        return t[t < 3.1], values[t < 3.1]

    found = check(changed(drive(0), tuple(drive(0).channels), short), nigel)
    assert ("pose.*", "too_short") in said(found)
    assert not found.usable.can_diagnose
    assert (found.suspicions, found.relations) == ((), ())


@pytest.mark.parametrize("rows", [0, 1, 2, 20])
def test_next_to_no_rows_do_not_raise(drive: Drive, nigel: Car, rows: int) -> None:
    few = changed(drive(0), POSE, lambda t, values: (t[:rows], values[:rows]))
    assert not check(few, nigel).usable.can_diagnose


def test_constant_commands_show_steady_driving_only(drive: Drive, nigel: Car) -> None:
    held = changed(drive(0), COMMANDS, lambda t, values: (t, np.full_like(values, 0.4)))
    assert {(name, "constant") for name in COMMANDS} <= said(check(held, nigel))


def test_shuffled_commands_are_of_another_drive(drive: Drive, nigel: Car) -> None:
    rng = np.random.default_rng(3)

    def shuffled(t: Floats, values: Floats) -> tuple[Floats, Floats]:
        parts = np.array_split(values, 40)
        return t, np.concatenate([parts[i] for i in rng.permutation(40)])

    found = check(changed(drive(0), COMMANDS, shuffled), nigel)
    assert ("command.steering", "without_effect") in said(found)
    assert not found.usable.can_diagnose


def test_commands_of_another_drive_are_noticed(drive: Drive, nigel: Car) -> None:
    other = {name: drive(1).channels[name] for name in COMMANDS}
    mixed = replace(drive(0), channels={**drive(0).channels, **other})
    assert ("command.steering", "without_effect") in said(check(mixed, nigel))


def test_another_cars_file_is_refused(drive: Drive) -> None:
    found = check(drive(0), load_car("f1tenth"))
    assert ("*", "other_car") in said(found)
    assert not found.usable.can_diagnose
