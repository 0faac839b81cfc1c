"""Recordings in which the camera lost the car for a while: nothing is held against guesses."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import Noise
from scm.mismatch.fit.residual_windows import LENGTH_S, WindowWhitener
from scm.mismatch.fit.rollouts import Rollouts
from scm.replay.drive import POSES, Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive

FIRST_S, LAST_S, TURNED = 5.0, 13.0, 2.0


def lost(first_s=FIRST_S, last_s=LAST_S, names=POSES):
    """A healthy drive of 20 s, without poses for a while, in which it was put down elsewhere."""
    whole = made_drive()
    channels = dict(whole.channels)
    x, y, yaw = (channels[name] for name in POSES)
    c, s = np.cos(TURNED), np.sin(TURNED)
    moved = 2.0 + c * x.values - s * y.values, s * x.values + c * y.values, yaw.values + TURNED
    for name, elsewhere in zip(POSES, moved, strict=True):
        channel = channels[name]
        keep = (channel.t < first_s) | (channel.t > last_s)
        values = np.where(channel.t > last_s, elsewhere, channel.values)
        if name in names:
            channels[name] = replace(channel, t=channel.t[keep], values=values[keep])
    return Drive(replace(whole, channels=channels), big_nigel())


@pytest.fixture(scope="module")
def drive():
    return lost()


def test_a_span_without_poses_is_blind(drive):
    ((first, last),) = drive.blind
    assert first == pytest.approx(FIRST_S, abs=0.04)
    assert last == pytest.approx(LAST_S, abs=0.04)
    at = np.array([first - 0.5, first + 0.1, last - 0.1, last + 0.1])
    assert drive.is_blind(at).tolist() == [False, True, True, False]
    assert drive.is_blind(at, length_s=1.0).tolist() == [True, True, True, False]


def test_poses_that_are_merely_slow_or_miss_a_moment_are_not_blind():
    assert lost(5.0, 5.8).blind == ()
    assert lost(0.0, 0.0).blind == ()


def test_one_channel_of_the_pose_that_is_missing_is_enough():
    assert lost(names=("pose.yaw",)).blind != ()


def test_the_right_model_leaves_noise_after_a_car_was_seen_again(drive):
    model = Likelihood.of([drive], big_nigel())
    e, _ = model([{}])
    (whitener,), left = model.whiteners, e[:, 0] ** 2
    poses = np.isin(whitener.stream, [drive.names.index(name) for name in POSES])
    after = poses & (whitener.t >= LAST_S) & (whitener.t < LAST_S + 1.0)
    assert np.all(model.valid[(whitener.t > FIRST_S + 0.1) & (whitener.t < LAST_S - 0.1)] == 0.0)
    assert np.all(model.valid[after] == 1.0)
    assert left[after].max() < 16.0
    assert left[after].mean() < 1.5


def test_a_car_that_is_not_seen_is_not_carried(drive):
    rollouts, blind = Rollouts(drive, big_nigel()), Rollouts(drive, big_nigel())
    guessed = drive.is_blind(drive.edges)
    blind._yaw = np.where(guessed, 1.0 + blind._yaw, blind._yaw)
    a, b = (one.run([{"wind.force_x_n": 0.2}])["speed"] for one in (rollouts, blind))
    np.testing.assert_array_equal(a, b)


def test_no_stride_leads_through_the_dark(drive):
    noise = Noise(0.01, 0.01, 0.01, dict.fromkeys(drive.names, 0.1), {})
    cuts = np.linspace(drive.edges[0], drive.edges[-1], 5)
    strides = WindowWhitener(drive, noise, cuts)
    begins = np.unique(strides.t) - 0.5 * LENGTH_S
    assert len(begins) > 10
    assert not np.any((begins + LENGTH_S > FIRST_S + 0.05) & (begins < LAST_S - 0.05))
