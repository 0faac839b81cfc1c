"""Noise by counting is normal, independent in every direction, and nobody else's business."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from scm.vehicles.noise import bases_of, key_of, normals, uniforms
from scm.vehicles.sensor_noise import MAX_WALK_S, wander

COUNT = 400_000


def rows(key, first, number, width=400):
    counters = np.arange(first, first + number)
    return normals(bases_of(np.full(number, key, np.uint64), counters), width)


@pytest.fixture(scope="module")
def block():
    return rows(key_of(3, "ann", "imu"), 0, 1000)


def test_it_is_normal(block):
    assert_allclose([block.mean(), block.var()], [0.0, 1.0], atol=4.0 * np.sqrt(2.0 / COUNT))
    assert stats.kstest(block.ravel(), "norm").pvalue > 1e-3
    assert np.abs(block).max() > 4.0


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ((slice(1, None), slice(None)), (slice(None, -1), slice(None))),
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
        ((slice(None), slice(200, None)), (slice(None), slice(None, 200))),
    ],
    ids=["next reading", "next value", "the pair"],
)
def test_neighbours_are_independent(block, first, second):
    a, b = block[first].ravel(), block[second].ravel()
    for left, right in ((a, b), (a**2 - 1.0, b**2 - 1.0)):
        assert abs(np.mean(left * right)) < 4.5 * np.std(left) * np.std(right) / np.sqrt(len(a))


@pytest.mark.parametrize("other", [(4, "ann", "imu"), (3, "bob", "imu"), (3, "ann", "lidar")])
def test_seed_car_and_device_each_make_other_noise(block, other):
    correlation = np.corrcoef(block.ravel(), rows(key_of(*other), 0, 1000).ravel())[0, 1]
    assert abs(correlation) < 4.5 / np.sqrt(COUNT)


def test_a_row_is_the_same_in_any_batch_and_order(block):
    key = key_of(3, "ann", "imu")
    counters = np.array([700, 3, 999])
    got = normals(bases_of(np.full(3, key, np.uint64), counters), 400)
    assert_array_equal(got, block[counters])


def test_uniforms_never_reach_their_ends_and_fill_evenly():
    u = uniforms(bases_of(np.full(2000, key_of(0, "a"), np.uint64), np.arange(2000)), 100)
    assert 0.0 < u.min() < 1e-4
    assert 1.0 > u.max() > 1.0 - 1e-4
    assert stats.kstest(u.ravel(), "uniform").pvalue > 1e-3


def test_an_odd_number_of_values_is_made():
    assert normals(bases_of(np.zeros(2, np.uint64), np.arange(2)), 9).shape == (2, 9)


def test_a_walk_has_independent_steps_of_one():
    keys = np.array([key_of(1, str(i)) for i in range(400)])
    steps = np.diff([wander(keys, np.full(400, s), 2) for s in range(40)], axis=0)
    assert np.var(steps) == pytest.approx(1.0, rel=0.05)
    assert abs(np.mean(steps[1:] * steps[:-1])) < 4.5 / np.sqrt(steps[1:].size)


def test_a_walk_begins_at_nought_and_goes_on_for_days():
    keys = np.array([key_of(1, str(i)) for i in range(2000)])
    assert_array_equal(wander(keys, np.zeros(2000, np.int64), 1), 0.0)
    far = wander(keys, np.full(2000, MAX_WALK_S - 1), 1)
    assert np.std(far) == pytest.approx(np.sqrt(MAX_WALK_S), rel=0.08)
