"""What every sensor keeps: its rate, one seed one noise, and the truth when nothing spoils it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm import registry
from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.vehicles.car import car_names, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensor import Around, Sampler, Sensor

PACKAGE = "scm.vehicles.sensors"
KINDS = registry.names(PACKAGE)
WALL = np.array([[2.0, -5.0, 2.0, 5.0]])


def sensor(kind):
    return registry.load(PACKAGE, kind, "SENSOR", Sensor)


@pytest.fixture(scope="module")
def fleet():
    cars = Fleet(load_car("nigel"), 3)
    for i in range(3):
        cars.throttle[cars.add(Pose2(0.0, 1.0 * i, 0.3 * i), speed=0.1)] = 0.5
    cars.advance(0.5)
    return cars


def measured(kind, fleet, rows):
    around = Around(WALL, np.array([-1]), np.array(rows))
    return sensor(kind).measure(fleet.car, fleet, np.array(rows), around)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_is_named_after_its_file(kind):
    assert sensor(kind).name == kind


@pytest.mark.parametrize("car", car_names())
@pytest.mark.parametrize("kind", KINDS)
def test_a_shipped_car_describes_its_device_or_has_none(kind, car):
    model = load_car(car)
    if not sensor(kind).is_fitted(model):
        pytest.skip(f"{car} has no {kind}")
    facts = sensor(kind).facts(model)
    assert facts.rate_hz > 0.0
    assert min(facts.noise) >= 0.0
    assert 0.0 <= facts.drop_out < 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_measuring_moves_nothing_and_repeats_bit_for_bit(kind, fleet):
    before = [fleet.planar_cog(row) for row in range(3)]
    assert_array_equal(measured(kind, fleet, [0, 1, 2]), measured(kind, fleet, [0, 1, 2]))
    assert before == [fleet.planar_cog(row) for row in range(3)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_car_measures_the_same_alone_and_in_company(kind, fleet):
    together = measured(kind, fleet, [2, 0, 1])
    assert_array_equal(measured(kind, fleet, [0])[0], together[1])


@pytest.mark.parametrize("kind", KINDS)
def test_without_noise_a_reading_is_the_truth_to_its_quantum(kind, fleet):
    facts = replace(sensor(kind).facts(fleet.car), noise=(0.0,))
    exact = measured(kind, fleet, [1])[0]
    sampler = Sampler(facts, np.random.default_rng(0))
    sampler.take(0, exact)
    (reading,) = sampler.ready(0)
    expected = np.floor(exact) if facts.quantum else exact
    assert_array_equal(reading.values, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_the_device_keeps_its_rate(kind, fleet):
    facts = sensor(kind).facts(fleet.car)
    sampler = Sampler(facts, np.random.default_rng(0))
    reads = sum(sampler.is_due(t) for t in range(0, 10 * NS_PER_S, NS_PER_S // 500))
    assert reads == round(10 * facts.rate_hz)


@pytest.mark.parametrize("kind", KINDS)
def test_one_seed_one_noise(kind, fleet):
    facts, exact = sensor(kind).facts(fleet.car), measured(kind, fleet, [1])[0]

    def read(seed):
        sampler = Sampler(facts, np.random.default_rng(seed))
        sampler.take(0, exact)
        return sampler.ready(0)[0].values

    assert_array_equal(read(3), read(3))
    if any(facts.noise):
        finite = np.isfinite(exact)
        assert (read(3)[finite] != read(4)[finite]).all()
