"""Recordings of the independent reality read as anyone's do, and show what is concealed."""

import math
from functools import cache

import numpy as np
import pytest

from scm.recording.read import read_recordings
from tests.reality import motion
from tests.reality.cases import apply
from tests.reality.concealed import EFFECTS, UNLISTED
from tests.reality.numbers import nominal
from tests.reality.recorded import record, write
from tests.reality.sensing import FAULTS, inertial

SECONDS = 20.0


def recorded(car="nigel", seconds=SECONDS, seed=1, numbers=None, **faults):
    rng = np.random.default_rng(seed)
    return record(car, nominal(car) | (numbers or {}), FAULTS | faults, seconds, rng)


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_a_recording_reads_with_all_its_channels_and_rates(car, tmp_path):
    write(recorded(car), car, nominal(car), tmp_path)
    recording = read_recordings(tmp_path)[0]
    assert recording.vehicle == car
    rates = {"command.throttle": 20.0, "pose.x": 30.0, "encoder.left": 50.0, "imu.gyro_z": 100.0}
    for name, rate in rates.items():
        t = recording.channel(name).t
        assert len(t) / (t[-1] - t[0]) == pytest.approx(rate, rel=0.05)
    assert recording.channel("pose.yaw").std == 0.0087


def test_poses_scatter_about_the_truth_as_they_say():
    drive = recorded()
    true = np.interp(drive.poses[:, 0], drive.rows[:, 0], drive.rows[:, 1])
    off = drive.poses[:, 1] - true
    assert np.std(off) == pytest.approx(0.002, rel=0.2)
    assert abs(np.mean(off)) < 0.0005


def test_the_driver_follows_his_route_and_stops_now_and_then():
    speeds = recorded(seconds=90.0).rows[:, 4]
    assert np.mean(np.abs(speeds) < 0.005) > 0.01
    assert np.percentile(speeds, 90) > 0.15


def test_the_same_seed_gives_the_same_drive():
    np.testing.assert_array_equal(recorded(seed=5).imu, recorded(seed=5).imu)
    assert not np.array_equal(recorded(seed=5).imu, recorded(seed=6).imu)


def test_an_accelerometer_shows_the_push_of_its_own_instant():
    rows = np.zeros((400, len(motion.ROW)))
    rows[:, 0] = rows[:, 7] = motion.ROW_S * np.arange(1, 401)
    imu = inertial(rows, FAULTS, (0.0, 0.0), 1.0, np.random.default_rng(0))
    np.testing.assert_allclose(imu[:-1, 1], imu[:-1, 0], atol=1e-9)


def test_a_late_camera_shows_where_the_car_was():
    late = recorded("f1tenth", delay=0.1)
    moving = np.interp(late.poses[:, 0] - 0.1, late.rows[:, 0], late.rows[:, 1])
    assert np.std(late.poses[10:, 1] - moving[10:]) < 0.006


def test_a_fast_clock_stamps_the_last_pose_late():
    fast = recorded(clock_rate=0.01)
    assert fast.poses[-1, 0] == pytest.approx(SECONDS + 0.01 * (SECONDS - 0.2), abs=0.08)


def test_lost_counts_and_large_wheels_count_less():
    usual = recorded()
    lost = recorded(lost_counts=0.1)
    assert lost.encoders[-1, 1] == pytest.approx(0.9 * usual.encoders[-1, 1], abs=2)


def test_the_gyro_shows_its_bias_at_rest():
    still = recorded(gyro_bias=0.05).imu[:10, 3]
    assert np.mean(still) == pytest.approx(0.05, abs=0.003)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_names_numbers_that_there_are(name):
    effect = EFFECTS[name]
    for car, smallest in effect.smallest.items():
        drawn = effect.draw(smallest, np.random.default_rng(0), car)
        known = nominal(car) | FAULTS
        assert {*drawn.adds, *drawn.times} <= set(known)
        assert all(math.isfinite(value) for value in drawn.parameters.values())
        assert bool(drawn.law) != effect.listed


def test_there_are_laws_enough_outside_the_library():
    assert len(UNLISTED) >= 8
    assert len({(law.equation, law.depends_on) for law in UNLISTED}) >= 6


ELSEWHERE = {"surface_patch", "cliff", "swirl", "left_lag"}
"""They act where the car may not come, or where it may not turn, in some seconds."""


@cache
def usual(car, seconds):
    return recorded(car, seconds)


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - ELSEWHERE))
def test_every_effect_changes_what_is_recorded(name):
    seconds = 8.0
    for car, smallest in EFFECTS[name].smallest.items():
        drawn = EFFECTS[name].draw(2.0 * smallest, np.random.default_rng(0), car)
        effects = [(name, 2.0, drawn)]
        numbers, faults = apply(nominal(car), effects), apply(FAULTS, effects)
        changed = record(car, numbers, faults, seconds, np.random.default_rng(1))
        same = [
            np.array_equal(getattr(changed, table), getattr(usual(car, seconds), table))
            for table in ("poses", "encoders", "imu")
        ]
        assert not all(same)
