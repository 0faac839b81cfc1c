"""A sampler makes one car's readings: at its rate, late, noisy, sometimes lost, from one seed."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.vehicles.sensor import Facts, Sampler

TICK = 20 * NS_PER_MS
EXACT = np.array([1.5, -2.25])


def readings(facts, seed=1, seconds=1, offset=0.0):
    sampler = Sampler(facts, np.random.default_rng(seed), offset)
    out = []
    for now in range(0, seconds * NS_PER_S, TICK):
        if sampler.is_due(now):
            sampler.take(now, EXACT)
        out += [(now, reading) for reading in sampler.ready(now)]
    return out


def test_without_noise_a_reading_is_the_truth():
    assert_array_equal(readings(Facts(rate_hz=7.0))[0][1].values, EXACT)


def test_a_device_faster_than_the_tick_reads_once_a_tick():
    assert len(readings(Facts(rate_hz=100.0))) == 50


def test_latency_delays_a_reading_but_not_its_time_stamp():
    now, reading = readings(Facts(rate_hz=5.0, latency_s=0.04))[0]
    assert (reading.t_ns, now) == (0, 40 * NS_PER_MS)


def test_the_offset_moves_the_first_reading_within_its_period():
    assert readings(Facts(rate_hz=5.0), offset=0.5)[0][0] == 100 * NS_PER_MS


def test_equal_seeds_give_equal_noise_and_other_seeds_other_noise():
    facts = Facts(rate_hz=50.0, noise=(0.1,))
    first, again, other = (
        np.array([r.values for _, r in readings(facts, seed)]) for seed in (1, 1, 2)
    )
    assert_array_equal(first, again)
    assert (first != other).all()


def test_noise_has_the_spread_of_each_value():
    values = [r.values for _, r in readings(Facts(50.0, noise=(0.1, 0.4)), seconds=60)]
    # 3000 readings: the spread is known to 1.3 % (one sigma).
    assert np.std(values, axis=0) == pytest.approx([0.1, 0.4], rel=0.06)


def test_drop_out_loses_its_share_of_readings():
    got = len(readings(Facts(rate_hz=50.0, drop_out=0.25), seconds=60))
    assert got == pytest.approx(0.75 * 3000, rel=0.05)


def test_a_quantum_rounds_towards_minus_infinity():
    assert_array_equal(readings(Facts(5.0, quantum=1.0))[0][1].values, [1.0, -3.0])
