"""What a likelihood remembers of sets that were driven, and how much memory it works in."""

import threading
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from scm.mismatch.budget import Budget, OutOfTimeError
from scm.mismatch.fit import likelihood
from scm.mismatch.fit.fitter import Fitter
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.fit.noise import usual_noise
from scm.mismatch.fit.rollouts import ROWS, Rollouts, Tiles
from scm.mismatch.fit.whitening import Whitener
from scm.mismatch.validate.found_car import patched
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, car_with, driven, made_drive

CACHED = 3


class Interrupted(Budget):
    """Ends at the second check after `armed`."""

    armed, checks = False, 0

    def check(self):
        self.checks += self.armed
        if self.checks == 2:  # the first tile was driven
            raise OutOfTimeError


@pytest.fixture(scope="module")
def drive():
    return Drive(made_drive(seconds=4.0), big_nigel())


@pytest.fixture(scope="module")
def tiles():
    return Tiles(big_nigel())


@pytest.fixture
def model(drive, tiles, monkeypatch):
    monkeypatch.setattr(likelihood, "MAX_CACHED", CACHED)
    return Likelihood.of([drive], big_nigel(), tiles, Interrupted())


def trims(*numbers):
    return [{"steering.trim_rad": 0.01 * n} for n in numbers]


def left(model, *numbers):
    (streams,), ok = model.residuals(trims(*numbers))
    assert ok.all()
    return np.concatenate(streams)


def test_a_set_has_the_same_residuals_however_often_and_whenever_it_is_asked_for(model):
    alone = {n: left(model, n)[:, 0] for n in range(6)}
    for asked in ((0, 1, 2), (2, 2, 0, 4, 4), (5, 4, 3, 2, 1, 0), (1, 5, 1), (3, 0, 3, 1)):
        expected = np.stack([alone[n] for n in asked], axis=1)
        np.testing.assert_array_equal(left(model, *asked), expected)


def test_what_is_done_to_residuals_is_not_remembered(model):
    before = left(model, 1)
    (streams,), _ = model.residuals(trims(1))
    for stream in streams:
        stream[:] = 1.0
    np.testing.assert_array_equal(left(model, 1), before)


def test_the_sets_stored_last_are_remembered(monkeypatch):
    monkeypatch.setattr(likelihood, "MAX_CACHED", CACHED)
    recent = likelihood.RecentSets(events=2)
    keys = [frozenset({("steering.trim_rad", 0.01 * n)}) for n in range(9)]
    for stored, remembered in (
        ((1, 2, 3), {1, 2, 3}), ((4, 1), {3, 4, 1}), ((5,), {4, 1, 5}), ((6,), {1, 5, 6}),
        ((5, 2, 7, 8, 6), {7, 8, 6}), ((1, 2, 1, 3), {2, 1, 3}),
    ):  # fmt: skip
        residuals = np.tile(np.array(stored, dtype=float), (2, 1))
        recent.store([keys[n] for n in stored], residuals, np.ones(len(stored), dtype=bool))
        assert {n for n, key in enumerate(keys) if key in recent} == remembered
        assert all((recent.of(keys[n])[0] == n).all() for n in remembered)


def test_two_cars_that_are_physical_and_one_that_is_not_are_remembered_as_such(model):
    sets = [*trims(0), {"body.mass_kg": -1.0}, *trims(1)]
    first, second = (model.residuals(sets)[1].tolist() for _ in range(2))
    assert first == second == [True, False, True]


def test_many_sets_are_weighed_in_the_room_of_residuals_and_innovations(drive, tiles):
    model = Likelihood.of([drive], big_nigel(), tiles)
    model(trims(0))
    sets = [{"steering.trim_rad": 1e-4 * n} for n in range(480)]
    tracemalloc.start()
    e, _ = model(sets)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.6 * e.nbytes


def test_a_belief_beyond_what_numbers_can_hold_has_no_size_and_raises_no_warning(drive):
    usual = usual_noise([drive])
    wild = replace(usual, speed=2.0**49 * usual.speed)
    assert np.isfinite(Whitener(drive, usual).log_size).all()
    assert not np.isfinite(Whitener(drive, wild).log_size).all()


def test_sets_whose_driving_is_given_up_leave_nothing_behind(model):
    many = trims(*range(2 * ROWS))
    expected = left(model, 1, 2)
    model.simulator.budget.armed = True
    with pytest.raises(OutOfTimeError):
        model(many)
    np.testing.assert_array_equal(left(model, 1, 2), expected)


def test_what_one_thread_raises_waits_until_the_others_are_done(drive, tiles):
    raised, returned, done = threading.Event(), threading.Event(), []

    def use(_motions, which):
        if 0 in which:  # the calling thread's first tile
            raised.set()
            raise OutOfTimeError
        assert raised.wait(60.0)
        returned.wait(0.5)  # long enough for who would not wait
        done.append(which)

    with pytest.raises(OutOfTimeError):
        Rollouts(drive, big_nigel(), tiles).each(trims(*range(2 * ROWS)), use)
    assert len(done) == 1
    returned.set()


BIAS = "measure.gyro_bias_rad_s"


def biased_score(car):
    sense = lambda name, _, v: v + 0.05 if name == "imu.gyro_z" else v  # noqa: E731
    model = Likelihood.of([driven(seconds=4.0, sense=sense)], car)
    return model, Fitter(model, np.ones(len(model.t))).unfitted().score


def test_a_fault_of_a_sensor_that_the_car_file_states_is_driven():
    _, without = biased_score(big_nigel())
    model, known = biased_score(car_with({BIAS: 0.05}))
    assert known < 0.5 * without
    assert BIAS not in [number.key for number in model.nominal]


def test_a_stated_fault_with_a_std_is_one_of_the_cars_own_numbers_and_is_written(tmp_path):
    car = car_with({BIAS: 0.05})
    unsure = replace(car.quantity(BIAS), std=0.01)
    car = replace(car, values={**car.values, BIAS: unsure})
    model, _ = biased_score(car)
    (at,) = (i for i, number in enumerate(model.nominal) if number.key == BIAS)
    assert model.simulator.unit(BIAS) == "rad/s"
    z = np.zeros(len(model.nominal))
    z[at] = 1.0
    found = patched(car, Fitter(model, np.ones(len(model.t))).unfitted(z), tmp_path)
    assert found.value(BIAS) == pytest.approx(0.06)
