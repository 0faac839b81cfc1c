"""The general effect: nothing at neutral, and what its numbers say elsewhere."""

import math

import numpy as np

from scm.geometry import Pose2
from scm.mismatch.discovery.general_effect import learned_terms, mixed, shaped
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.unit.mismatch.discovery.made_effect import lawful_nigel
from tests.unit.mismatch.made_drive import STEP_S, big_nigel, commands

NONE = dict.fromkeys(
    ("sine", "cosine", "one", "line", "size", "square", "cube", "heavy", "ramp", "step", "comb"),
    0.0,
)  # fmt: skip
COMB = {"comb_at": 0.0, "comb_every": 1000.0, "comb_wide": 1.0}


def at(q, time=0.0, **numbers):
    return shaped(q, time, **(NONE | COMB | numbers))


def test_a_car_that_carries_it_moves_as_before_bit_for_bit():
    _, throttle, steering = commands(3.0)
    runs = []
    for car in (big_nigel(), lawful_nigel()):
        fleet = Fleet(car, 1)
        fleet.add(Pose2(0.0, 0.0, 0.0))
        runs.append(fleet.rollout(throttle, steering, STEP_S, ("x", "yaw", "speed")))
    for name in runs[0]:
        np.testing.assert_array_equal(runs[0][name], runs[1][name])


def test_a_mix_is_each_variable_times_its_weight():
    values = (2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0)
    x, y = values[1:3]
    for i, value in enumerate((*values, 5.0)):
        weights = [0.0] * 11
        weights[i] = 0.5
        assert mixed(*values, *weights, x - 3.0, y + 4.0, 1.0) == 1.0 + 0.5 * value


def test_a_wave_goes_through_its_mix():
    assert math.isclose(at(0.7, sine=2.0), 2.0 * math.sin(0.7), rel_tol=1e-12)
    assert math.isclose(at(0.7, cosine=2.0), 2.0 * math.cos(0.7), rel_tol=1e-12)


def test_powers_keep_or_lose_the_sign():
    assert [at(-2.0, **{k: 1.0}) for k in ("line", "size", "square", "cube", "heavy")] == [
        -2.0, 2.0, 4.0, -8.0, 8.0,
    ]  # fmt: skip


def test_ramps_and_steps_begin_at_zero():
    assert (at(-1.0, ramp=1.0), at(2.0, ramp=1.0)) == (0.0, 2.0)
    assert [at(q, step=1.0) for q in (-0.5, 0.0, 0.5, 9.0)] == [0.0, 0.5, 1.0, 1.0]


def test_hats_return_after_the_comb_s_pitch():
    hats = {"comb": 1.0, "comb_at": 2.0, "comb_every": 8.0, "comb_wide": 0.1}
    times = (2.0, 10.0, 2.05, 6.0, 9.95)
    np.testing.assert_allclose([at(0.0, t, **hats) for t in times], [1, 1, 0.5, 0, 0.5], atol=1e-9)


def test_a_car_whose_throttle_is_late_keeps_that():
    late = load_car("nigel").with_terms(["drive_delay"])
    assert all(term.sets != "throttle_received" for term in learned_terms(late))
