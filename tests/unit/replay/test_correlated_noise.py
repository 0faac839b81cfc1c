"""Whether noise is seen to last, by a channel alone."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.fit.noise import usual_noise
from scm.mismatch.fit.whitening import Whitener
from scm.replay.correlated_noise import WHITE_NOISE, Correlated, correlated_noise
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive

STD, LASTING = 0.002, Correlated(0.9, 0.2)


def tracked(noise, seed=3, std=STD):
    """Times and two coordinates of a car on an uneven round, 50 a second."""
    t, rng = np.arange(0.0, 40.0, 0.02), np.random.default_rng(seed)
    way = 0.25 * t + 0.05 * np.sin(1.1 * t)
    truths = np.cos(way) + 0.1 * np.cos(2.3 * way), np.sin(way)
    return [(t, truth + std * noise.drawn(t, rng), STD) for truth in truths]


@pytest.mark.parametrize("lasts_s", [0.1, 0.2, 0.4])
def test_noise_that_lasts_is_found_and_how_long(lasts_s):
    found = correlated_noise(tracked(Correlated(0.99, lasts_s)))
    assert found.share >= 0.9
    assert 0.5 * lasts_s <= found.lasts_s <= 2.0 * lasts_s


@pytest.mark.parametrize("std", [STD, 0.3 * STD], ids=["as stated", "smaller than stated"])
def test_white_noise_is_white(std):
    assert correlated_noise(tracked(WHITE_NOISE, std=std)) == WHITE_NOISE


def test_drawn_noise_lasts_as_long_as_it_says():
    t = 0.02 * np.arange(200_000)
    noise = LASTING.drawn(t, np.random.default_rng(1))
    assert noise.std() == pytest.approx(1.0, abs=0.02)
    for steps in (1, 5, 10):
        alike = float(np.mean(noise[steps:] * noise[:-steps]))
        assert alike == pytest.approx(0.9 * np.exp(-0.02 * steps / 0.2), abs=0.03)


def test_inflated_white_noise_leaves_a_mean_as_unsure():
    t = 0.02 * np.arange(2000)
    rng = np.random.default_rng(2)
    means = [LASTING.drawn(t, rng).mean() for _ in range(400)]
    assert np.std(means) == pytest.approx(LASTING.inflation(0.02) / np.sqrt(len(t)), rel=0.1)


@pytest.fixture(scope="module")
def drive():
    """Its poses have noise of 8 mm that lasts for 0.2 s beside the usual 2 mm."""

    def noisier(name, t, values):
        std = {"pose.x": 0.008, "pose.y": 0.008, "pose.yaw": 0.035}.get(name, 0.0)
        return values + std * Correlated(0.99, 0.2).drawn(t, np.random.default_rng(ord(name[-1])))

    recording = made_drive(seconds=20.0, sense=noisier)
    for name, std in (("pose.x", 0.0082), ("pose.y", 0.0082), ("pose.yaw", 0.036)):
        recording.channels[name] = replace(recording.channels[name], std=std)
    return Drive(recording, big_nigel())


def alike_from_one_to_the_next(drive, residuals):
    whitener = Whitener(drive, usual_noise([drive]))
    innovations = whitener.innovations(residuals)[:, 0]
    x = innovations[whitener.stream == drive.names.index("pose.x")][20:]
    return float(np.mean(x[1:] * x[:-1]) / np.mean(x * x)), float(np.mean(x * x))


def test_innovations_of_noise_that_lasts_are_independent_and_of_unit_variance(drive):
    assert drive.stream("pose.x").correlated.share >= 0.9
    rng = np.random.default_rng(7)
    residuals = [s.drawn(s.t, rng)[:, None] for s in drive.streams]
    alike, size = alike_from_one_to_the_next(drive, residuals)
    assert abs(alike) < 0.15
    assert size == pytest.approx(1.0, abs=0.2)
    drive.streams = [replace(s, correlated=WHITE_NOISE) for s in drive.streams]
    alike, _ = alike_from_one_to_the_next(drive, residuals)
    assert alike > 0.5
