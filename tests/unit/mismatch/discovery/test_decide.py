"""Effects outside the catalogue end a selection by a margin only, and healthy drives give none."""

from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.discovery import decide
from scm.mismatch.select.search import Selection, retune
from tests.unit.mismatch.discovery import made_effect


def test_a_bent_lens_is_an_effect_of_the_camera_that_a_fit_takes_off():
    model, before, after = made_effect.lens()
    assert after.effects[0].equation == "sensor"
    np.testing.assert_allclose(after.values, 0.05, atol=0.015)
    assert after.score < before.score - 30.0
    assert len(after.innovations) == len(model.t)


def test_no_dictionary_effect_is_worth_its_penalty_on_a_healthy_drive():
    tried = made_effect.healthy()
    pairs = zip(tried.found, tried.criteria, strict=True)
    assert [f.names for f, criterion in pairs if criterion < tried.base.score] == []


@pytest.mark.parametrize(("by_far", "ends"), [(100.0, True), (1e4, False)])
def test_only_what_is_better_by_far_ends_a_selection(by_far, ends, monkeypatch):
    context, found, unseen, discovery = made_effect.discovered()
    monkeypatch.setattr(decide, "discover", lambda *_: discovery)
    monkeypatch.setattr(decide, "BY_FAR", by_far)
    all_of_it, offered = decide.explain(context, unseen, found)
    assert all_of_it is ends
    found = Selection(found.best, found.retuned, (), offered, is_explained=ends)
    best, tried = decide.decide(context, found, unseen)
    assert best.names == (made_effect.GUST_NAME,)
    assert tried is not None


def test_what_leaves_something_to_a_known_effect_does_not_end_a_selection(monkeypatch):
    context, found, unseen, discovery = made_effect.discovered()
    monkeypatch.setattr(decide, "discover", lambda *_: discovery)
    monkeypatch.setattr(decide, "BY_FAR", 100.0)
    really = decide.criterion_of
    worth = lambda context, fitted: really(context, fitted) - 1e4 * (len(fitted.effects) > 1)  # noqa: E731
    monkeypatch.setattr(decide, "criterion_of", worth)
    assert decide.explain(context, unseen, found)[0] is False


def test_a_dictionary_that_was_tried_in_vain_is_not_tried_again(monkeypatch):
    context, model, unseen = made_effect.context_of(made_effect.lawful_drive())
    retuned, tries = retune(context, model), []
    really = decide.try_dictionary
    monkeypatch.setattr(
        decide, "try_dictionary", lambda *given: (tries.append(1), really(*given))[1]
    )
    found = Selection(retuned, retuned)
    ends, offered = decide.explain(context, unseen, found)
    assert not ends
    found = Selection(retuned, retuned, (), offered)
    assert decide.explain(context, unseen, found) == (False, offered)  # it is computed once
    assert decide.decide(context, found, unseen) == (retuned, None)
    assert len(tries) == 1


def test_a_known_effect_whose_noise_fit_is_stuck_is_compared_from_low_noise_too(monkeypatch):
    context, found, unseen, discovery = made_effect.discovered()
    best = discovery.best.fitted
    noisy = replace(best.noise, speed=8.0 * best.noise.speed, side=8.0 * best.noise.side)
    (stuck,) = context.fitter(best.model.under(noisy)).refine([best], rounds=2, fresh=True)
    really = decide.fit_with_noise
    settled = lambda context, fitted: fitted if fitted is stuck else really(context, fitted)  # noqa: E731
    monkeypatch.setattr(decide, "fit_with_noise", settled)
    known = Selection(stuck, found.retuned, (), replace(discovery, beside=stuck))
    chosen, tried = decide.decide(context, known, unseen)
    assert tried is None  # it is the same effect, so it cannot be better than itself
    assert chosen.noise.speed < noisy.speed
