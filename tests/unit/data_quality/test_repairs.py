"""Gross faults are found, said and undone; nothing else is touched."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scm.data_quality.check import check
from scm.data_quality.prepare import prepare
from scm.data_quality.repairs import corrected
from scm.recording.read import Recording
from scm.vehicles.car import Car

Drive = Callable[[int], Recording]

UNITS = [
    (("imu.gyro_z",), math.degrees(1.0)),
    (("imu.gyro_z",), math.radians(1.0)),
    (("imu.gyro_z",), -1.0),
    (("imu.gyro_z",), 100.0),
    (("imu.gyro_z",), 0.01),
    (("imu.gyro_z",), 10.0),
    (("imu.gyro_z",), 1e-3),
    (("imu.gyro_z",), -100.0),
    (("imu.accel_x", "imu.accel_y"), 0.01),
    (("encoder.left", "encoder.right"), 100.0),
    (("pose.x", "pose.y"), 10.0),
    (("imu.accel_x", "imu.accel_y"), 1.0 / 9.80665),
    (("imu.accel_y",), -1.0),
    (("pose.yaw",), math.degrees(1.0)),
    (("pose.yaw",), -1.0),
    (("pose.y",), -1.0),
    (("pose.x", "pose.y"), 1000.0),
    (("pose.x", "pose.y"), 100.0),
    (("encoder.left", "encoder.right"), 4.0),
    (("encoder.left", "encoder.right"), -1.0),
    (("command.throttle",), 100.0),
    (("command.steering",), -1.0),
    (("command.steering",), 30.0),
]


def scaled(recording: Recording, names: tuple[str, ...], factor: float) -> Recording:
    channels = dict(recording.channels)
    for name in names:
        channels[name] = replace(channels[name], values=factor * channels[name].values)
    return replace(recording, channels=channels)


def moved(recording: Recording, family: str, shift_s: float, factor: float = 1.0) -> Recording:
    channels = {
        name: replace(c, t=factor * c.t + shift_s) if name.startswith(family) else c
        for name, c in recording.channels.items()
    }
    return replace(recording, channels=channels)


@pytest.mark.parametrize(("names", "factor"), UNITS)
def test_a_wrong_unit_or_sign_is_undone_and_said(
    drive: Drive, nigel: Car, names: tuple[str, ...], factor: float
) -> None:
    true = drive(0)
    wrong = scaled(true, names, factor)
    found = check(wrong, nigel)
    right = corrected(wrong, found)
    for name, channel in true.channels.items():
        np.testing.assert_allclose(
            right.channels[name].values, channel.values, rtol=1e-3, atol=1e-9
        )
    assert {problem.name for problem in found.problems} <= {"unit", "sign"}
    assert all(problem.corrected for problem in found.problems)
    assert all(suspicion.repaired for suspicion in found.suspicions)


def test_a_heading_that_points_backwards_is_turned_round(drive: Drive, nigel: Car) -> None:
    true = drive(0)
    yaw = true.channels["pose.yaw"]
    wrong = replace(
        true, channels={**true.channels, "pose.yaw": replace(yaw, values=yaw.values + math.pi)}
    )
    found = check(wrong, nigel)
    right = corrected(wrong, found).channels["pose.yaw"].values
    np.testing.assert_allclose(np.cos(right - yaw.values), 1.0, atol=1e-9)
    assert [problem.channel for problem in found.problems] == ["pose.yaw"]


@pytest.mark.parametrize("family", ["pose.", "imu.", "encoder."])
@pytest.mark.parametrize("shift_s", [0.8, -5.0, 1.7e9])
def test_clocks_that_are_far_apart_are_brought_together(
    drive: Drive, nigel: Car, family: str, shift_s: float
) -> None:
    wrong = moved(drive(0), family, shift_s)
    found = check(wrong, nigel)
    right = corrected(wrong, found)
    for name, channel in drive(0).channels.items():
        np.testing.assert_allclose(right.channels[name].t, channel.t, atol=0.02)
    assert {problem.name for problem in found.problems} == {"clock"}


@pytest.mark.parametrize("family", ["pose.", "imu.", ""])
def test_stamps_in_milliseconds_become_seconds(drive: Drive, nigel: Car, family: str) -> None:
    (right,) = prepare(moved(drive(0), family, 0.0, 1000.0), nigel).recordings
    for name, channel in drive(0).channels.items():
        np.testing.assert_allclose(right.channels[name].t, channel.t, atol=1e-6)


def test_a_speed_without_sign_takes_that_of_the_pose(drive: Drive, nigel: Car) -> None:
    there = drive(0)
    end = there.channels["pose.x"].t[-1]

    def back(name: str) -> tuple[np.ndarray, np.ndarray]:
        channel = there.channels[name]
        return (
            np.concatenate((channel.t, 2.0 * end + 0.03 - channel.t[::-1])),
            np.concatenate((channel.values, channel.values[::-1])),
        )

    poses = {name: replace(there.channels[name], t=back(name)[0], values=back(name)[1])
             for name in ("pose.x", "pose.y", "pose.yaw")}  # fmt: skip
    t, counts = back("encoder.left")
    metre = 2.0 * math.pi * 0.0325 / 1920.0
    both = 0.5 * metre * (counts + back("encoder.right")[1])
    speed = np.abs(np.gradient(np.convolve(both, np.ones(9) / 9.0, mode="same"), 0.02))
    turned = replace(there.channels["imu.gyro_z"], t=t, values=speed, dimension="speed")
    wrong = replace(there, channels={**poses, "speed": turned})
    found = check(wrong, nigel)
    assert ("speed", "sign") in {(p.channel, p.name) for p in found.problems}
    assert corrected(wrong, found).channels["speed"].values[-200:].max() < 0.0


def test_what_was_undone_is_named_as_the_library_names_it(drive: Drive, nigel: Car) -> None:
    (unit,) = check(scaled(drive(0), ("imu.gyro_z",), 57.29578), nigel).suspicions
    (clock,) = check(moved(drive(0), "pose.", 0.9), nigel).suspicions
    assert (unit.name, unit.channels) == ("unit_error", ("imu.gyro_z",))
    assert unit.values["factor"] == pytest.approx(57.29578)
    assert clock.name == "clock_offset"
    assert clock.values["offset"] == pytest.approx(0.9, abs=3.0 * clock.std["offset"])


def test_small_faults_are_left_for_the_fit(drive: Drive, nigel: Car) -> None:
    off = moved(scaled(drive(0), ("imu.gyro_z",), 1.05), "pose.", 0.08)
    assert corrected(off, check(off, nigel)) == off
