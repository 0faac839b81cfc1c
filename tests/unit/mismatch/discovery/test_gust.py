"""A gust, which the catalogue does not have: what is discovered, and what alternatives lack."""

from functools import cache

import numpy as np
import pytest

from scm.mismatch.discovery.decide import is_discovered
from scm.mismatch.discovery.try_dictionary import criterion
from scm.mismatch.report.sentences import advice_of
from scm.mismatch.validate.curves import discovered_curves
from scm.mismatch.validate.explain import effect_of
from scm.mismatch.validate.found_car import CarFiles
from scm.mismatch.validate.stages import RECORDED
from tests.unit.mismatch.discovery import made_effect
from tests.unit.mismatch.made_drive import nigel


@cache
def gust_reported():
    gusty = made_effect.gusty()
    return effect_of(gusty.selected, gusty.best, gusty.best.effects[0])


def test_a_gust_is_a_force_over_the_floor_against_time():
    found = made_effect.gusty().best
    law = found.effects[0]
    assert (law.name, law.equation, law.depends_on) == (
        "floor force against time",
        "body",
        ("time",),
    )
    np.testing.assert_allclose(found.values[2], made_effect.GUST[2], rtol=0.03)
    np.testing.assert_allclose(abs(found.values[0]), made_effect.GUST[0], rtol=0.15)


def test_laws_come_best_first_by_a_criterion_that_counts_their_numbers():
    tried = made_effect.gusty().discovery.tried
    assert list(tried.criteria) == sorted(tried.criteria)
    first = tried.found[0]
    assert criterion(first, 3000) > first.score + 4 * 8.0


def test_bins_of_a_curve_agree_with_the_law():
    gusty = made_effect.gusty()
    bins, fit = discovered_curves(gusty.best, gusty.discovery.tried)
    y = np.interp(bins.x, fit.x, fit.y)
    assert np.mean((bins.low <= y) & (y <= bins.high)) > 0.6
    assert np.ptp(fit.y) > 1.5


def test_a_law_takes_the_place_of_known_effects_only_by_a_margin():
    gusty = made_effect.gusty()
    assert all(is_discovered(e) for e in gusty.best.effects[:1])
    assert not any(is_discovered(e) for e in gusty.known.effects)
    assert gusty.discovery is not None


def test_the_listed_effects_that_a_law_was_held_against_are_its_rivals():
    effect = gust_reported()
    assert not effect.is_known
    assert {"wind", "steer_trim"} <= {rival.name for rival in effect.alternatives}
    assert effect.name not in {rival.name for rival in effect.alternatives}


def test_what_rules_a_law_s_rivals_out_is_how_much_worse_they_explain_the_recording():
    rivals = {one.name: one for one in gust_reported().alternatives}
    assert "worse by" in rivals["wind"].ruled_out_by
    assert "standard deviations" in rivals["steer_trim"].ruled_out_by


def test_probabilities_of_a_law_and_its_rivals_are_of_one_whole():
    effect = gust_reported()
    total = effect.probability + sum(rival.probability for rival in effect.alternatives)
    np.testing.assert_allclose(total, 1.0)
    assert effect.probability > 0.99


def test_a_law_against_a_recording_s_time_is_in_no_car_for_another_drive():
    fitted, effects = made_effect.gusty().best, (gust_reported(),)
    files = CarFiles(nigel(), ("made",))
    car = files.written(fitted, effects)
    file, period = "floor_force_against_time", float(fitted.values[2])
    assert file not in [term.name for term in car.terms]
    assert "only recorded.toml has it" in car.path.read_text(encoding="utf-8")
    (stage,) = files.stages(fitted, effects, car)
    assert stage.file == RECORDED
    assert stage.car.value(f"{file}.period_s") == pytest.approx(period, rel=1e-3)
    assert "recorded.toml does" in advice_of(effects[0])
