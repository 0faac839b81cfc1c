"""Shares and means with intervals, and which factor matters."""

import math

import numpy as np
import pytest

from scm.study import statistics, tables
from scm.study.statistics import half_width, main_effects, mean_of, wilson
from tests.unit.study.studying import Here, loaded


def rows_of(study):
    return [study.run(number) for number in range(len(study.design))]


@pytest.mark.parametrize(
    ("successes", "count", "low", "high"),
    # Newcombe 1998, "Two-sided confidence intervals for the single proportion", table I, method 3
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_s_interval_has_published_values(successes, count, low, high):
    found = wilson(successes, count)
    assert found.value == successes / count
    assert (found.low, found.high) == pytest.approx((low, high), abs=5e-5)


def test_no_case_says_nothing():
    assert wilson(0, 0)[1:3] == (0.0, 1.0)
    assert math.isnan(mean_of([]).value)
    assert mean_of([3.0, math.nan]) == (3.0, -math.inf, math.inf, 1)


def test_student_s_interval_covers_the_mean_nineteen_times_of_twenty():
    rng = np.random.default_rng(4)
    found = [mean_of(list(rng.normal(2.0, 1.0, 5))) for _ in range(2000)]
    assert np.mean([one.low <= 2.0 <= one.high for one in found]) == pytest.approx(0.95, abs=0.012)


def test_the_factor_that_moves_a_measure_explains_it(tmp_path):
    study = loaded(tmp_path, more="samples = 16", factors="b = { uniform = [0.0, 0.1] }")
    first, second = main_effects(rows_of(study), study.design.axes, "total")
    assert first.factor == "a"
    assert (first.at_lowest, first.at_highest) == ("1", "3")
    assert first.highest - first.lowest == pytest.approx(2.0, abs=0.1)
    assert first.share > 0.95
    assert first.p < 1e-6
    assert second.factor == "b"
    assert second.share < 0.05
    assert second.p > 0.01


def test_levels_of_a_drawn_factor_are_fifths(tmp_path):
    study = loaded(tmp_path, more="samples = 25", factors="b = { uniform = [0.0, 1.0] }")
    (_, axis), rows = study.design.axes, rows_of(study)
    groups = statistics.by_level(rows, axis)
    assert len(groups) == 5
    assert sum(map(len, groups.values())) == len(rows)
    means = [np.mean([row.values["b"] for row in group]) for group in groups.values()]
    assert means == sorted(means)


def test_the_widest_combination_decides_how_well_a_mean_is_known(tmp_path):
    study = loaded(tmp_path)
    rows = rows_of(study)
    of_level = [[row for row in rows if row.values["a"] == a] for a in (1.0, 2.0, 3.0)]
    widths = [half_width(some, "total", study.design) for some in of_level]
    assert half_width(rows, "total", study.design) == max(widths)


def test_failures_come_first_and_the_worst_of_them(tmp_path):
    study = loaded(tmp_path, factors="luck = [0.0]")

    class Results:
        rows = {row.case: row for row in Here(study).run([])} | dict(enumerate(rows_of(study)))

    Results.file = study.file
    failed = tables.ordered_failures(Results)
    assert {row.values["a"] for row in failed} == {3.0}
    assert all(row.outcome == "failure" for row in failed)
