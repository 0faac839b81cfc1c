"""A law's rivals: what the library offered in its place, other laws, and what rules them out."""

from functools import cache

import numpy as np

from scm.mismatch.explain import effect_of
from scm.mismatch.law_rivals import standing
from scm.mismatch.laws.decide import Lawful
from scm.mismatch.laws.seek import with_laws
from scm.mismatch.likelihood import Likelihood
from scm.mismatch.listed import by_name, candidates
from scm.mismatch.search import Search
from tests.unit.mismatch.laws import made_law


@cache
def gust_told():
    drive = made_law.lawful_drive(made_law.gust().numbers(made_law.GUST))
    model = with_laws(Likelihood([drive], made_law.lawful_nigel()))
    part = np.where(np.arange(len(model.t)) % 1000 < 800, 1.0, 0.0)
    library = [by_name(candidates(made_law.lawful_nigel()), n) for n in ("wind", "steer_trim")]
    search = Search(model, part, library, lambda _: None)
    listed = search.run()
    held = standing(search, listed, unseen=True)
    best, sought = Lawful(search, 1.0 - part).decide(listed)
    return effect_of(search, best, 0, held, sought)


def test_the_listed_effects_that_a_law_was_held_against_are_its_rivals():
    effect = gust_told()
    assert not effect.listed
    assert {"wind", "steer_trim"} <= {rival.name for rival in effect.rivals}
    assert effect.name not in {rival.name for rival in effect.rivals}


def test_what_rules_a_law_s_rivals_out_is_how_much_worse_they_explain_the_recording():
    rivals = {rival.name: rival for rival in gust_told().rivals}
    assert "worse by" in rivals["wind"].ruled_out_by
    assert "standard deviations" in rivals["steer_trim"].ruled_out_by


def test_probabilities_of_a_law_and_its_rivals_are_of_one_whole():
    effect = gust_told()
    total = effect.probability + sum(rival.probability for rival in effect.rivals)
    np.testing.assert_allclose(total, 1.0)
    assert effect.probability > 0.99
