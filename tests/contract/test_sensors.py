"""What every sensor keeps: its rate, one seed one noise, and the truth when nothing spoils it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm import registry
from scm.geometry import Pose2
from scm.vehicles.bank import Bank
from scm.vehicles.car import car_names, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Sensor, Sight

PACKAGE = "scm.vehicles.sensors"
KINDS = registry.names(PACKAGE)
WALL = np.array([[2.0, -5.0, 2.0, 5.0]])
SCENE = Scene(WallGrid(WALL), np.zeros((0, 4)), np.zeros(0, np.int64))


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
    around = Sight(SCENE, np.array(rows))
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


def quiet(facts):
    nothing = (0.0,)
    return replace(facts, noise=nothing, bias=nothing, walk=nothing, drop_out=0.0, latency_s=0.0)


def bank_of(kind, fleet, facts, seed=0):
    bank = Bank(replace(sensor(kind), facts=lambda car: facts), seed)
    for row in range(3):
        bank.fit(row, f"car{row}", fleet.car, fleet, row, 0)
    return bank


@pytest.mark.parametrize("kind", KINDS)
def test_without_noise_a_reading_is_the_truth_to_its_quantum(kind, fleet):
    facts = quiet(sensor(kind).facts(fleet.car))
    exact = measured(kind, fleet, [0, 1, 2])
    (readings,) = bank_of(kind, fleet, facts).step(0, lambda: SCENE)
    expected = np.floor(exact / facts.quantum) * facts.quantum if facts.quantum else exact.copy()
    if facts.seen is not None:
        expected[(exact < facts.seen[0]) | (exact > facts.seen[1])] = np.inf
    assert_array_equal(readings.values, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_the_names_of_the_values_fit_what_is_measured(kind, fleet):
    count = measured(kind, fleet, [0]).shape[1]
    assert len(sensor(kind).values) in {1, count}


@pytest.mark.parametrize("kind", KINDS)
def test_one_seed_one_noise(kind, fleet):
    facts = sensor(kind).facts(fleet.car)

    def read(seed):
        return bank_of(kind, fleet, facts, seed).step(0, lambda: SCENE)[0].values

    assert_array_equal(read(3), read(3))
    noisy = np.isfinite(read(3)) & np.isfinite(read(4))
    if any(facts.noise):
        noisy &= np.broadcast_to(np.array(facts.noise) > 0.0, noisy.shape)
        assert (read(3)[noisy] != read(4)[noisy]).all()
