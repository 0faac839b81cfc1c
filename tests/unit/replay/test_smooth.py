"""The smoother that knows no car."""

import numpy as np

from scm.replay.smooth import smooth


def wavy(seed=0, std=0.05):
    t = np.sort(np.random.default_rng(seed).uniform(0.0, 10.0, 400))
    truth = np.sin(1.5 * t)
    return t, truth, truth + np.random.default_rng(seed + 1).normal(0.0, std, len(t))


def test_a_smoothed_wave_is_nearer_than_its_samples_and_says_how_near():
    t, truth, noisy = wavy()
    smoothed = smooth(t, noisy, 0.05)
    error = smoothed.value - truth
    assert np.std(error) < 0.5 * np.std(noisy - truth)
    assert 0.5 < np.sqrt(np.mean((error / smoothed.std) ** 2)) < 1.25


def test_the_rate_is_that_of_the_wave():
    t, _, noisy = wavy()
    smoothed = smooth(t, noisy, 0.05)
    inner = slice(30, -30)
    assert np.std(smoothed.rate[inner] - 1.5 * np.cos(1.5 * t[inner])) < 0.15


def test_between_samples_it_meets_values_and_rates():
    t, _, noisy = wavy()
    smoothed = smooth(t, noisy, 0.05)
    np.testing.assert_allclose(smoothed.at(smoothed.t), smoothed.value, atol=1e-12)
    h = 1e-6
    slope = (smoothed.at(smoothed.t[5:-5] + h) - smoothed.at(smoothed.t[5:-5])) / h
    np.testing.assert_allclose(slope, smoothed.rate[5:-5], atol=1e-3)


def test_beyond_its_ends_it_holds():
    t, _, noisy = wavy()
    smoothed = smooth(t, noisy, 0.05)
    assert smoothed.at(np.array([-5.0]))[0] == smoothed.value[0]
