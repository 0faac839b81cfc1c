"""Numbers that change during a drive: what is simulated and predicted of them."""

import numpy as np
import pytest

from scm.mismatch.fit.likelihood import Likelihood
from scm.replay.numbers import BACK, BEFORE, SINCE, UNTIL, Change
from tests.unit.mismatch.made_drive import big_nigel, driven

SINCE_S = 10.0
CHANGED = {
    "steering.trim_rad": (0.0, 0.06),
    "wheel.radius_m": (0.0325, 0.031),
    "steering.delay_s": (0.0, 0.2),
    "measure.pose_heading_rad": (0.0, 0.05),
    "measure.pose_delay_s": (0.0, 0.1),
    "measure.gyro_bias_rad_s": (0.0, 0.05),
    "measure.pose_scale": (1.0, 1.04),
    "measure.encoder_loss": (0.0, 0.05),
}


@pytest.fixture(scope="module")
def model():
    return Likelihood.of([driven()], big_nigel())


def step(key, before, after, since_s=SINCE_S, until_s=None):
    until_s = since_s if until_s is None else until_s
    return {key: after, key + BEFORE: before, key + SINCE: since_s, key + UNTIL: until_s}


@pytest.mark.parametrize("key", CHANGED)
def test_a_number_that_changes_to_itself_changes_nothing(model, key):
    _, after = CHANGED[key]
    (e, ok) = model([{key: after}, step(key, after, after)])
    assert ok.all()
    assert np.abs(e[:, 0] - e[:, 1]).max() < 1e-9


@pytest.mark.parametrize("key", CHANGED)
def test_a_step_is_the_one_number_before_and_the_other_after(model, key):
    before, after = CHANGED[key]
    sets = [{key: before}, {key: after}, step(key, before, after)]
    (streams,), _ = model.residuals(sets)
    for stream, left in zip(model.drives[0].streams, streams, strict=True):
        t, moves = stream.t, np.diff(left, axis=0)
        assert np.abs(left[t < SINCE_S - 0.6, 2] - left[t < SINCE_S - 0.6, 0]).max() < 1e-9
        later = t[:-1] > SINCE_S + 1.5
        size = np.abs(moves[later, 1] - moves[later, 0]).max()
        assert np.abs(moves[later, 2] - moves[later, 1]).max() <= 0.05 * size + 1e-9, stream.name


def test_a_ramp_goes_evenly_from_one_number_to_the_other():
    change = Change(0, "steering.trim_rad", 0.0, 0.1, 10.0, 20.0)
    at = np.array([5.0, 10.0, 12.5, 20.0, 30.0])
    assert change.done(at, at + 1e-6) == pytest.approx([0.0, 0.0, 0.25, 1.0, 1.0], abs=1e-6)
    assert change.done(np.array([10.0]), np.array([20.0])) == pytest.approx([0.5])


def test_a_change_that_is_taken_back_is_done_between_two_moments_only():
    change = Change(0, "steering.trim_rad", 0.0, 0.1, 10.0, 10.0, 20.0)
    at = np.array([5.0, 12.0, 19.0, 25.0])
    assert change.done(at, at + 1e-6) == pytest.approx([0.0, 1.0, 1.0, 0.0], abs=1e-6)
    assert change.done(np.array([15.0, 0.0]), np.array([25.0, 40.0])) == pytest.approx([0.5, 0.25])
    never = Change(0, "steering.trim_rad", 0.0, 0.1, 10.0, 10.0, 8.0)
    assert np.abs(never.done(at, at + 3.0)).max() == 0.0


@pytest.mark.parametrize("key", CHANGED)
def test_a_number_that_comes_and_goes_is_other_between_two_moments_only(model, key):
    before, after = CHANGED[key]
    came = step(key, before, after)
    sets = [{key: before}, came, came | {key + BACK: 14.0}]
    (streams,), _ = model.residuals(sets)
    for stream, left in zip(model.drives[0].streams, streams, strict=True):
        t, moves = stream.t, np.diff(left, axis=0)
        assert np.abs(left[t < 13.4, 2] - left[t < 13.4, 1]).max() < 1e-9
        later = t[:-1] > 15.5
        size = np.abs(moves[later, 1] - moves[later, 0]).max()
        assert np.abs(moves[later, 2] - moves[later, 0]).max() <= 0.05 * size + 1e-9, stream.name


def test_several_sets_may_change_at_different_times(model):
    sets = [step("measure.pose_heading_rad", 0.0, 0.05, t) for t in (6.0, 14.0)]
    together, _ = model([*sets, {}])
    for column, numbers in enumerate(sets):
        alone, _ = Likelihood.of([driven()], big_nigel())([numbers])
        assert np.abs(together[:, column] - alone[:, 0]).max() < 1e-9
