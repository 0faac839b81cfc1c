"""The twin's benches count alarms until the first, and find the tail of healthy cars' scores."""

import math

import numpy as np
import pytest

from bench.twin_false_alarms import STRETCH_S, Healthy, run_length, tail
from bench.twin_peer_methods import LEARN_S, SPANS_S, departures


def test_drive_counts_until_its_first_alarm():
    driven_s = 600.0 * np.arange(1, 7)
    silent, loud = np.full(6, 3.0), np.array([3.0, 3.0, 9.0, 9.0, 3.0, 9.0])
    hours, alarms = run_length([Healthy(driven_s, silent), Healthy(driven_s, loud)], 8.0)
    assert hours == pytest.approx(1.0 + 0.5)
    assert alarms == 1


def test_tail_of_scores_is_found():
    hourly, per_fold = 6.4, 0.7
    rng, stretch_h = np.random.default_rng(1), STRETCH_S / 3600.0
    highest = rng.gumbel(hourly + per_fold * math.log(stretch_h), per_fold, 2000)
    driven_s = STRETCH_S * (np.arange(2000) + 0.5)
    found_hourly, found_per_fold, peaks = tail([Healthy(driven_s, highest)])
    assert found_hourly == pytest.approx(hourly, abs=0.15)
    assert found_per_fold == pytest.approx(per_fold, rel=0.2)
    assert peaks > 100


def test_departure_is_the_newest_mean_less_that_of_all_before():
    t = 0.5 * np.arange(800)
    values = np.where(t < 300.0, 1.0, 3.0)[:, None]
    moved = departures(t, values, 0.0)[:, SPANS_S.index(10.0), 0]
    assert moved[np.searchsorted(t, 309.5)] == pytest.approx(2.0)
    assert np.nanmax(np.abs(moved[t < 299.0])) == pytest.approx(0.0)
    assert np.isnan(moved[t < LEARN_S + 9.0]).all()
