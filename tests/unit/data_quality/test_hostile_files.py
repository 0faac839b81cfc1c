"""What a hostile user brings: each file says what is wrong, and no fault is made up for it."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from scm.data_quality.check import check
from scm.data_quality.prepare import prepare
from scm.data_quality.quality import Quality
from scm.data_quality.repairs import corrected
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car, load_car

Drive = Callable[[int], Recording]

POSE = ("pose.x", "pose.y", "pose.yaw")
COMMANDS = ("command.throttle", "command.steering")
STD = {"pose.x": 0.002, "pose.y": 0.002, "pose.yaw": 0.0087, "imu.accel_x": 0.03,
       "imu.accel_y": 0.03, "imu.gyro_z": 0.002}  # fmt: skip


def names_of(found: Quality) -> set[str]:
    return {problem.name for problem in found.problems}


def changed(recording: Recording, change: Callable[[str, Channel], Channel]) -> Recording:
    channels = {name: change(name, channel) for name, channel in recording.channels.items()}
    return replace(recording, channels=channels)


def standing(recording: Recording, first_s: float, last_s: float) -> Recording:
    """The same drive, but the car stands before and after a while of it."""
    rng = np.random.default_rng(4)

    def stand(name: str, channel: Channel) -> Channel:
        t, values = channel.t, channel.values.copy()
        noise = STD.get(name, 0.0) * rng.standard_normal(len(t))
        early, late = t < first_s, t >= last_s
        moves = name.startswith(("pose.", "encoder."))
        middle = values[~early & ~late]
        begin, end = (middle[0], middle[-1]) if moves and len(middle) else (0.0, 0.0)
        values[early], values[late] = begin + noise[early], end + noise[late]
        return replace(channel, values=values)

    return changed(recording, stand)


@pytest.mark.parametrize("missing", COMMANDS)
def test_one_command_is_not_enough(drive: Drive, nigel: Car, missing: str) -> None:
    kept = {name: c for name, c in drive(0).channels.items() if name != missing}
    found = check(replace(drive(0), channels=kept), nigel)
    assert found.usable.lacks == (f"missing: {missing}",)


def test_a_short_drive_in_a_long_stand_makes_no_sensor_wrong(drive: Drive, nigel: Car) -> None:
    found = check(standing(drive(0), 10.0, 16.0), nigel)
    assert not names_of(found) & {"unit", "sign", "frozen", "unrelated"}
    assert found.usable.can_diagnose


def test_a_car_that_never_moves_allows_no_verdict(drive: Drive, nigel: Car) -> None:
    found = check(standing(drive(0), 100.0, 100.0), nigel)
    assert not names_of(found) & {"unit", "sign", "frozen", "unrelated", "without_effect"}
    assert found.usable.lacks == ("the car does not move",)


def test_rows_without_a_number_are_counted_in_each_column(drive: Drive, nigel: Car) -> None:
    rng = np.random.default_rng(2)

    def holes(name: str, c: Channel) -> Channel:
        keep = rng.random(len(c.t)) > (0.05 if name in POSE else -1.0)
        return replace(c, values=np.where(keep, c.values, np.nan))

    found = prepare(changed(drive(0), holes), nigel)
    x, y, yaw = (found.recordings[0].channels[name].t for name in POSE)
    np.testing.assert_array_equal(x, y)
    np.testing.assert_array_equal(x, yaw)
    assert {p.channel for p in found.problems if p.name == "not_finite"} == set(POSE)


@pytest.mark.parametrize("car", ["dart", "f1tenth"])
def test_the_file_of_another_car_is_told_whatever_drives_it(drive: Drive, car: str) -> None:
    assert ("*", "other_car") in {
        (p.channel, p.name) for p in check(drive(0), load_car(car)).problems
    }


def test_a_car_of_half_the_length_is_told_by_its_turning(drive: Drive, nigel: Car) -> None:
    short = nigel.with_terms([], {"body.wheelbase_m": 0.4 * nigel.value("body.wheelbase_m")})
    assert ("*", "other_car") in {(p.channel, p.name) for p in check(drive(0), short).problems}


def test_without_a_verdict_it_is_said_what_can_still_be_concluded(drive: Drive, nigel: Car) -> None:
    def biased(name: str, c: Channel) -> Channel:
        return replace(c, values=c.values + 0.1) if name == "imu.gyro_z" else c

    kept = {name: c for name, c in drive(0).channels.items() if name not in COMMANDS}
    undriven = replace(drive(0), channels=kept)
    healthy = check(undriven, nigel).problems[0]
    assert healthy.name == "no_verdict"
    assert "agree" in healthy.text
    assert healthy.record_instead
    assert "+0.10" in check(changed(undriven, biased), nigel).problems[0].text


def test_a_recording_that_runs_backwards_in_time_allows_no_verdict(
    drive: Drive, nigel: Car
) -> None:
    def mirror(_name: str, c: Channel) -> Channel:
        return replace(c, t=90.0 - c.t[::-1], values=c.values[::-1].copy())

    found = check(changed(drive(0), mirror), nigel)
    assert found.usable.lacks == ("time runs backwards",)


def test_poses_once_a_second_do_not_call_a_stopped_encoder_frozen(drive: Drive, nigel: Car) -> None:
    def slow(name: str, c: Channel) -> Channel:
        return replace(c, t=c.t[::30], values=c.values[::30]) if name in POSE else c

    assert names_of(check(changed(standing(drive(0), 0.0, 70.0), slow), nigel)) == {"slow"}


def test_a_recording_without_any_noise_is_no_reason_to_warn(drive: Drive, nigel: Car) -> None:
    def exact(name: str, c: Channel) -> Channel:
        way = np.clip(0.2 * (c.t - 5.0), 0.0, 6.0)
        values = {"pose.x": way, "pose.y": 0.0 * way, "pose.yaw": 0.0 * way}
        gyro = np.zeros_like(c.t) if name == "imu.gyro_z" else c.values
        return replace(c, values=values.get(name, gyro))

    check(changed(drive(0), exact), nigel)


def test_ten_seconds_are_enough_to_see_commands_of_another_drive(drive: Drive, nigel: Car) -> None:
    def cut(first_s: float, recording: Recording) -> Mapping[str, Channel]:
        def within(_name: str, c: Channel) -> Channel:
            keep = (c.t >= first_s) & (c.t < first_s + 10.0)
            return replace(c, t=c.t[keep] - first_s, values=c.values[keep])

        return changed(recording, within).channels

    own, other = cut(40.0, drive(0)), cut(20.0, drive(2))
    mixed = {name: other[name] if name in COMMANDS else c for name, c in own.items()}
    assert "without_effect" not in names_of(check(replace(drive(0), channels=own), nigel))
    assert "without_effect" in names_of(check(replace(drive(0), channels=mixed), nigel))


def test_a_std_beside_a_wrong_unit_is_not_believed(drive: Drive, nigel: Car) -> None:
    def degrees(name: str, c: Channel) -> Channel:
        if name != "pose.yaw":
            return c
        return replace(c, values=np.degrees(c.values), std=0.0087)

    recording = changed(drive(0), degrees)
    assert corrected(recording, check(recording, nigel)).channels["pose.yaw"].std is None
