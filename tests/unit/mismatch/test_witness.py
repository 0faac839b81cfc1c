"""A kinematic bicycle as witness: the plain model that every car found is held against."""

import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.validate.free_runs import judge
from scm.mismatch.validate.witness import NAMES, OF_STEERING, rms, strayed_by, witness_of
from scm.recording.read import Channel, Recording
from scm.replay.drive import Drive
from scm.vehicles.car import load_car
from tests.unit.mismatch.made_drive import big_nigel, commands, nigel

POSE_STD_M = 1e-3
PLANTED = {
    "steering_gain_rad": 0.35,
    "steering_offset_rad": 0.04,
    "steering_delay_s": 0.12,
    "understeer_s2_per_m2": 0.5,
    "speed_gain_mps": 1.4,
    "dead_band": 0.15,
    "throttle_delay_s": 0.06,
    "time_constant_s": 0.4,
}


def planted(seconds):
    """The recording of a bicycle with these numbers, integrated in steps of a millisecond."""
    at, throttle, steering = commands(seconds)
    throttle = np.where((at % 9.0) < 1.5, -throttle, throttle)  # it reverses now and then
    t, dt = np.arange(0.0, seconds, 1e-3), 1e-3
    held = lambda values, late: values[np.maximum(  # noqa: E731
        np.searchsorted(at, t - late, side="right") - 1, 0)]  # fmt: skip
    drive = held(throttle, PLANTED["throttle_delay_s"])
    past = np.sign(drive) * np.maximum(np.abs(drive) - PLANTED["dead_band"], 0.0)
    angle = PLANTED["steering_gain_rad"] * held(steering, PLANTED["steering_delay_s"])
    bend = np.tan(angle + PLANTED["steering_offset_rad"]) / nigel().value("body.wheelbase_m")
    speed = np.zeros(len(t))
    for k in range(1, len(t)):
        lacks = PLANTED["speed_gain_mps"] * past[k] - speed[k - 1]
        speed[k] = speed[k - 1] + dt * lacks / PLANTED["time_constant_s"]
    yaw = np.cumsum(dt * speed * bend / (1.0 + PLANTED["understeer_s2_per_m2"] * speed**2))
    way = {"x": np.cumsum(dt * speed * np.cos(yaw)), "y": np.cumsum(dt * speed * np.sin(yaw))}
    rng, seen = np.random.default_rng(3), t[::30]
    channels = {
        "command.throttle": Channel(at, throttle, None, (0.0, 0.0), "ratio"),
        "command.steering": Channel(at, steering, None, (0.0, 0.0), "ratio"),
    }
    for name, values in {**way, "yaw": yaw}.items():
        noisy = values[::30] + POSE_STD_M * rng.standard_normal(len(seen))
        kind = "angle" if name == "yaw" else "length"
        channels[f"pose.{name}"] = Channel(seen, noisy, POSE_STD_M, (0.0, 0.0), kind)
    return Recording(Path("planted/recording.yaml"), "nigel", channels)


@cache
def judged(seconds=60.0):
    """A drive of the planted bicycle, and free runs of a Nigel beside it."""
    drive = Drive(planted(seconds), big_nigel())
    parts = split(Likelihood.of([drive], big_nigel()), 5.0)
    return (drive, *judge([drive], nigel(), nigel(), parts, 1.0))


def test_planted_numbers_are_found_and_follow_the_car_as_far_as_noise_allows():
    drive, fit, runs = judged()
    found = witness_of([drive], nigel(), runs)
    assert tuple(found.numbers) == NAMES
    for name, value in PLANTED.items():
        assert found.numbers[name] == pytest.approx(value, rel=0.1, abs=0.02), name
    floor = fit.confirm.noise_floor
    assert found.position_m < 2.5 * floor["position_m"] < 0.3 * fit.confirm.before["position_m"]
    assert found.yaw_rad < 2.5 * floor["yaw_rad"]


def test_the_windows_it_is_judged_on_do_not_fit_it():
    drive, _, runs = judged()
    unseen = np.flatnonzero(np.array(runs.part) == "confirm")
    half = np.delete(np.arange(len(runs.part)), unseen[::2])
    fewer = replace(
        runs, part=tuple(runs.part[i] for i in half), recording=runs.recording[half],
        stamp_s=runs.stamp_s[half],
    )  # fmt: skip
    one, other = (witness_of([drive], nigel(), some) for some in (runs, fewer))
    assert one.numbers == other.numbers
    assert one.position_m != other.position_m


def test_too_few_windows_have_no_witness():
    drive, _, runs = judged()
    for part in (("confirm",) * len(runs.part), ("fit",) * len(runs.part)):
        assert witness_of([drive], nigel(), replace(runs, part=part)) is None


def test_the_errors_follow_from_the_numbers():
    drive, _, runs = judged()
    found = witness_of([drive], nigel(), runs)
    unseen = np.array(runs.part) == "confirm"
    windows = runs.recording[unseen], runs.stamp_s[unseen]
    again = strayed_by([drive], nigel(), windows, 1.0, found.numbers)
    assert rms(again["position_m"]) == found.position_m
    assert rms(again["yaw_rad"]) == found.yaw_rad
    wrong = {**found.numbers, "steering_gain_rad": 0.2}
    far = strayed_by([drive], nigel(), windows, 1.0, wrong)
    assert rms(far["yaw_rad"]) > 5.0 * found.yaw_rad


def test_where_the_measured_speed_drives_the_car_it_has_the_numbers_of_the_steering(
    root: Path,
):
    drive, _, runs = judged()
    channels = dict(drive.recording.channels)
    x, y, yaw = (drive.smoothed[f"pose.{name}"] for name in ("x", "y", "yaw"))
    speed = np.cos(yaw.value) * x.rate + np.sin(yaw.value) * y.rate
    channels["speed"] = Channel(x.t, speed, 0.01, (0.0, 0.0), "speed")
    del channels["command.throttle"]
    led = load_car(str(root / "recordings/cars/f1tenth_clemson.toml"))
    drive = Drive(replace(drive.recording, channels=channels), led)
    found = witness_of([drive], led, runs)
    assert tuple(found.numbers) == NAMES[OF_STEERING]
    late_s = PLANTED["steering_delay_s"]
    assert found.numbers["steering_delay_s"] == pytest.approx(late_s, abs=0.02)


def test_a_drive_of_90_s_takes_less_than_3_s():
    drive, _, runs = judged(90.0)
    begun = time.process_time()
    assert witness_of([drive], nigel(), runs) is not None
    assert time.process_time() - begun < 3.0
