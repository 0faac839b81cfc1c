"""The least squares under white noise on a random walk keeps its promises."""

import numpy as np
import pytest

from scm.arrays import Floats
from scm.data_quality.whitened_fit import fit

ROWS = 800


def noisy(rng: np.random.Generator, walk: float) -> Floats:
    return rng.standard_normal(ROWS) + np.cumsum(walk * rng.standard_normal(ROWS))


@pytest.mark.parametrize("walk", [0.0, 0.05, 0.5, 3.0])
def test_standard_errors_hold_for_any_mix_of_noise(walk: float) -> None:
    rng = np.random.default_rng(7)
    column = np.sin(np.arange(ROWS) / 30.0) + 0.01 * np.arange(ROWS)
    off = []
    for _ in range(60):
        found = fit((2.0 * column + noisy(rng, walk))[:, None], column[:, None, None])
        off.append((found.values[0] - 2.0) / found.std[0])
    assert 0.5 < float(np.std(off)) < 1.35


def test_a_factor_that_nothing_shows_stays_unknown() -> None:
    rng = np.random.default_rng(1)
    still = np.full((ROWS, 1, 1), 3.0)
    assert fit(noisy(rng, 0.1)[:, None], still).std[0] > 10.0


def test_two_columns_alike_leak_into_each_other() -> None:
    rng = np.random.default_rng(2)
    one = np.sin(np.arange(ROWS) / 20.0)
    two = one + 0.01 * np.cos(np.arange(ROWS) / 7.0)
    found = fit((one + 0.1 * noisy(rng, 0.1))[:, None], np.stack((one, two), axis=1)[:, None, :])
    assert found.leak.min() > 20.0


def test_outliers_move_a_factor_by_less_than_its_standard_error() -> None:
    rng = np.random.default_rng(3)
    column = np.sin(np.arange(ROWS) / 15.0)
    clean = column + 0.1 * rng.standard_normal(ROWS)
    dirty = clean.copy()
    dirty[::100] += 8.0
    calm, upset = (fit(y[:, None], column[:, None, None]) for y in (clean, dirty))
    assert abs(upset.values[0] - calm.values[0]) < 2.0 * calm.std[0]


def test_nothing_is_said_about_a_step_between_stretches() -> None:
    rng = np.random.default_rng(4)
    column = np.arange(ROWS) / 100.0
    y = column + 0.01 * rng.standard_normal(ROWS)
    y[ROWS // 2 :] += 50.0
    found = fit(y[:, None], column[:, None, None], starts=(0, ROWS // 2))
    assert found.values[0] == pytest.approx(1.0, abs=0.01)
