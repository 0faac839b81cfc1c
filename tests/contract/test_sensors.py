"""What every sensor keeps: its rate, one seed one noise, and the truth when nothing spoils it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from scm import registry
from scm.clock import NS_PER_S
from scm.geometry import Pose2
from scm.vehicles.bank import Bank
from scm.vehicles.car import car_names, load_car
from scm.vehicles.car_file_schema import file_keys
from scm.vehicles.fleet import Fleet
from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene
from scm.vehicles.sensor import Sensor, Surroundings

PACKAGE = "scm.vehicles.sensors"
DOCS = Path(__file__).parents[2] / "docs"
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
    around = Surroundings(SCENE, np.array(rows))
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
    device = sensor(kind).device(model)
    assert device.rate_hz > 0.0
    assert min(device.noise) >= 0.0
    assert 0.0 <= device.drop_out < 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_measuring_moves_nothing_and_repeats_bit_for_bit(kind, fleet):
    before = [fleet.planar_cog(row) for row in range(3)]
    assert_array_equal(measured(kind, fleet, [0, 1, 2]), measured(kind, fleet, [0, 1, 2]))
    assert before == [fleet.planar_cog(row) for row in range(3)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_car_measures_the_same_alone_and_in_company(kind, fleet):
    together = measured(kind, fleet, [2, 0, 1])
    assert_array_equal(measured(kind, fleet, [0])[0], together[1])


def quiet(device):
    nothing = (0.0,)
    return replace(device, noise=nothing, bias=nothing, walk=nothing, drop_out=0.0, latency_s=0.0)


def bank_of(kind, fleet, device, seed=0):
    bank = Bank(replace(sensor(kind), device=lambda car: device), seed)
    for row in range(3):
        bank.fit(row, f"car{row}", fleet.car, fleet, row, 0)
    return bank


@pytest.mark.parametrize("kind", KINDS)
def test_without_noise_a_reading_is_the_truth_to_its_quantum(kind, fleet):
    device = quiet(sensor(kind).device(fleet.car))
    exact = measured(kind, fleet, [0, 1, 2])
    (readings,) = bank_of(kind, fleet, device).step(0, lambda: SCENE)
    expected = np.floor(exact / device.quantum) * device.quantum if device.quantum else exact.copy()
    if device.seen is not None:
        expected[(exact < device.seen[0]) | (exact > device.seen[1])] = np.inf
    assert_array_equal(readings.values, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_the_names_of_the_values_fit_what_is_measured(kind, fleet):
    count = measured(kind, fleet, [0]).shape[1]
    assert len(sensor(kind).values) in {1, count}


@pytest.mark.parametrize("kind", KINDS)
def test_one_seed_one_noise(kind, fleet):
    device = sensor(kind).device(fleet.car)

    def read(seed):
        return bank_of(kind, fleet, device, seed).step(0, lambda: SCENE)[0].values

    assert_array_equal(read(3), read(3))
    noisy = np.isfinite(read(3)) & np.isfinite(read(4))
    if any(device.noise):
        noisy &= np.broadcast_to(np.array(device.noise) > 0.0, noisy.shape)
        assert (read(3)[noisy] != read(4)[noisy]).all()


SECTION = {"encoders": "encoder"}
"""Sections of the car file that are named otherwise than their sensor."""


def section(kind):
    return SECTION.get(kind, kind)


def nigel_with(kind, **numbers):
    """Return a Nigel whose file says other numbers of its device; keys without the section."""
    return load_car("nigel").with_terms(
        (), {f"{section(kind)}.{key}": number for key, number in numbers.items()}
    )


def noise_keys(kind):
    start = f"{section(kind)}."
    return [
        key.removeprefix(start) for key in file_keys() if key.startswith(start) and "noise" in key
    ]


def read_for(kind, car, fleet, seconds, seed=0):
    """Return the first car's readings as (came after [ns], values), looked at every 10 ms."""
    bank = Bank(sensor(kind), seed)
    bank.fit(0, "ann", car, fleet, 0, 0)
    steps = range(0, round(seconds * NS_PER_S), NS_PER_S // 100)
    return [(now - r.t_ns, r.values[0]) for now in steps for r in bank.step(now, lambda: SCENE)]


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_keeps_the_rate_of_its_file(kind, fleet):
    assert len(read_for(kind, nigel_with(kind, rate_hz=20.0, drop_out=0.0), fleet, 2.0)) == 40


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_has_the_latency_in_its_file(kind, fleet):
    car = nigel_with(kind, rate_hz=20.0, drop_out=0.0, latency_s=0.03)
    assert {late for late, _ in read_for(kind, car, fleet, 1.0)} == {30_000_000}


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_loses_the_share_in_its_file(kind, fleet):
    got = len(read_for(kind, nigel_with(kind, rate_hz=50.0, drop_out=0.4), fleet, 10.0))
    # 500 readings: the share is known to 0.022 (one sigma).
    assert got / 500 == pytest.approx(0.6, abs=0.09)


@pytest.mark.parametrize("kind", KINDS)
def test_every_noise_of_the_file_spreads_readings(kind, fleet):
    assert noise_keys(kind)
    for key in noise_keys(kind):
        car = nigel_with(kind, rate_hz=50.0, **dict.fromkeys(noise_keys(kind), 0.0) | {key: 0.8})
        got = np.array([values for _, values in read_for(kind, car, fleet, 1.0)])
        never_missed = got[:, np.isfinite(got).all(axis=0)]
        assert (np.ptp(never_missed, axis=0) > 0.5).any(), key


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_without_noise_gives_the_truth(kind, fleet):
    others = [key for key in ("drop_out", "latency_s", "quantum", "quantum_m", "quantum_rad",
                              "bias_rad", "heading_bias_rad", "heading_walk_rad_sqrt_s",
                              "accel_walk_m_s2_sqrt_s", "gyro_walk_rad_s_sqrt_s")
              if f"{section(kind)}.{key}" in file_keys()]  # fmt: skip
    car = nigel_with(kind, rate_hz=20.0, **dict.fromkeys(noise_keys(kind) + others, 0.0))
    exact = sensor(kind).measure(car, fleet, np.array([0]), Surroundings(SCENE, np.array([0])))[0]
    exact = np.floor(exact) if kind == "encoders" else exact
    readings = read_for(kind, car, fleet, 1.0)
    assert len(readings) == 20
    for late, values in readings:
        assert late == 0
        assert_array_equal(values, exact)


@pytest.mark.parametrize("kind", [*KINDS, "camera"])
def test_every_key_of_a_sensor_is_in_its_page(kind):
    page = DOCS / ("cameras.md" if kind == "camera" else "sensors.md")
    text = page.read_text(encoding="utf-8")
    keys = [key.partition(".")[2] for key in file_keys() if key.startswith(f"{section(kind)}.")]
    assert {"rate_hz", "latency_s", "drop_out"} <= set(keys)
    assert [key for key in keys if f"`{key}`" not in text] == []
