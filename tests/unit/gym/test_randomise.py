"""Numbers that are drawn for each episode: by the car file's spread, and evenly from ranges."""

from dataclasses import replace

import numpy as np
import pytest

from scm.errors import CarError
from scm.gym.randomise import Randomise, with_effects
from scm.vehicles.car import load_car
from scm.vehicles.correlated import Correlated
from scm.vehicles.fleet import Fleet
from scm.vehicles.noise import bases_of

NIGEL = load_car("nigel")
DRAWN = 2000


def drawn(car, spread=0.0, ranges=None):
    fleet = Fleet(car, DRAWN)
    rows = np.arange(DRAWN)
    keys = bases_of(np.full(DRAWN, 5, np.uint64), rows)
    Randomise(fleet, spread, ranges or {}).draw(rows, keys)
    return {column.param.key: fleet.parameters[:, k] for k, column in enumerate(fleet.columns)}


def test_numbers_with_a_standard_deviation_spread_by_it_and_others_stay():
    numbers = drawn(NIGEL, 2.0)
    mass = NIGEL.values["body.mass_kg"]
    assert numbers["body.mass_kg"].std() == pytest.approx(2.0 * mass.std, rel=0.06)
    assert numbers["body.mass_kg"].mean() == pytest.approx(mass.value, abs=0.1 * mass.std)
    certain = [key for key, one in numbers.items() if not NIGEL.values[key].std]
    assert certain
    assert all(np.ptp(numbers[key]) == 0.0 for key in certain)


def test_correlations_of_the_file_hold():
    pair = ("drive.no_load_speed_rad_s", "drive.stall_torque_nm")
    assert all(NIGEL.values[key].std for key in pair), "the test needs two uncertain numbers"
    car = replace(NIGEL, correlated=(Correlated(pair, ((1.0, -0.9), (-0.9, 1.0))),))
    numbers = drawn(car, 1.0)
    assert np.corrcoef(*(numbers[key] for key in pair))[0, 1] == pytest.approx(-0.9, abs=0.03)


def test_ranges_are_drawn_from_evenly_and_an_effect_that_was_lacking_is_added():
    ranges = {"payload.mass_kg": (0.2, 1.0)}
    car = with_effects(NIGEL, ranges)
    assert {term.name for term in car.terms} - {term.name for term in NIGEL.terms} == {"payload"}
    mass = drawn(car, ranges=ranges)["payload.mass_kg"]
    assert (mass.min(), mass.max()) == pytest.approx((0.2, 1.0), abs=0.005)
    assert np.histogram(mass, 4)[0].min() > 0.2 * DRAWN


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        ({"payload.mas_kg": (0.0, 1.0)}, r"no effect has it.*payload\.mass_kg"),
        ({"payload.mass_kg": (1.0, 0.0)}, "expected low and high, got 1.0 and 0.0"),
        ({"payload.mass_kg": (0.0, 99.0)}, "from 0 to 99: expected -0.1 to 20 kg"),
    ],
)
def test_wrong_ranges_say_what_is_expected(ranges, words):
    with pytest.raises(CarError, match=words):
        Randomise(Fleet(with_effects(NIGEL, ranges), 1), 0.0, ranges)
