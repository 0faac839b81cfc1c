"""Laws outside the library end a search by a margin only, and healthy drives give none."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.discovery import decide
from scm.mismatch.discovery.decide import Lawful
from tests.unit.mismatch.discovery import made_effect


def test_a_bent_lens_is_a_law_of_the_camera_that_a_fit_takes_off():
    model, before, after = made_effect.lens()
    assert after.effects[0].equation == "sensor"
    np.testing.assert_allclose(after.values, 0.05, atol=0.015)
    assert after.q < before.q - 30.0
    assert len(after.e) == len(model.t)


def test_no_law_is_worth_its_price_on_a_healthy_drive():
    sought = made_effect.healthy()
    assert [
        f.names for f, c in zip(sought.found, sought.criteria, strict=True) if c < sought.base.q
    ] == []


@pytest.mark.parametrize(("by_far", "ends"), [(100.0, True), (1e4, False)])
def test_only_a_law_that_is_better_by_far_ends_a_search(by_far, ends, monkeypatch):
    search, laws = made_effect.asked()
    monkeypatch.setattr(decide, "seek", None)  # what was sought already is not sought again
    monkeypatch.setattr(decide, "BY_FAR", by_far)
    listed, noise = search.retuned, search.model.noise
    assert laws.explains_all(listed) is ends
    assert search.model.noise == noise
    found, sought = laws.decide(listed)
    assert found.names == (made_effect.GUST_NAME,)
    assert sought is not None


def test_a_law_that_leaves_something_to_a_listed_effect_does_not_end_a_search(monkeypatch):
    search, laws = made_effect.asked()
    monkeypatch.setattr(decide, "BY_FAR", 100.0)
    price = decide._price
    worth = lambda search, fitted: price(search, fitted) - 1e4 * (len(fitted.effects) > 1)  # noqa: E731
    monkeypatch.setattr(decide, "_price", worth)
    assert not laws.explains_all(search.retuned)


def test_laws_that_were_sought_in_vain_are_not_sought_again(monkeypatch):
    search, unseen = made_effect.searched(made_effect.lawful_drive())
    laws, listed, seeks = Lawful(search, unseen), search.retuned, []
    seek = decide.seek
    monkeypatch.setattr(decide, "seek", lambda *given: (seeks.append(1), seek(*given))[1])
    assert not laws.explains_all(listed)
    assert not laws.explains_all(replace(listed, z=listed.z + 0.1))  # it is asked once
    assert laws.decide(listed) == (listed, None)
    assert len(seeks) == 1
