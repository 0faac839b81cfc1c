"""Which cases a study has: all combinations, drawn factors, seeds."""

import itertools

import numpy as np
import pytest

from scm.study.design import value_at
from scm.vehicles.car import load_car
from tests.unit.study.studying import loaded

B = "b = { uniform = [10.0, 20.0] }"


def test_each_replication_has_all_combinations_before_the_next_begins(tmp_path):
    design = loaded(tmp_path, factors="b = { grid = [0.0, 1.0, 3] }").design
    assert (len(design), design.points) == (36, 9)
    for replication in range(4):
        numbers = range(replication * 9, (replication + 1) * 9)
        assert {design.replication(n) for n in numbers} == {replication}
        found = [tuple(design.values(n).values()) for n in numbers]
        assert found == list(itertools.product([1.0, 2.0, 3.0], [0.0, 0.5, 1.0]))


def test_seeds_are_hashes_of_study_and_number(tmp_path):
    design = loaded(tmp_path).design
    seeds = [design.seed(n) for n in range(len(design))]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**48 for seed in seeds)
    assert seeds == [loaded(tmp_path).design.seed(n) for n in range(len(design))]
    assert seeds[0] != loaded(tmp_path, name="other").design.seed(0)
    assert seeds[0] != loaded(tmp_path, more="seed = 1").design.seed(0)


def test_paired_cases_share_the_seed_of_their_replication(tmp_path):
    design = loaded(tmp_path, more="paired = true").design
    seeds = [design.seed(n) for n in range(len(design))]
    assert len(set(seeds)) == 4
    assert seeds[:3] == [seeds[0]] * 3


def test_drawn_factors_are_drawn_anew_in_each_replication_and_shared_by_combinations(tmp_path):
    design = loaded(tmp_path, factors=B).design
    draws = [design.values(n)["b"] for n in range(len(design))]
    assert all(10.0 <= draw <= 20.0 for draw in draws)
    assert len(set(draws)) == 4
    assert draws[:3] == [draws[0]] * 3


@pytest.mark.parametrize("sampling", ["latin_hypercube", "sobol"])
def test_even_samples_have_one_draw_in_each_stratum(tmp_path, sampling):
    more = f'samples = 16\nsampling = "{sampling}"'
    design = loaded(tmp_path, more=more, factors=f"{B}\nluck = {{ uniform = [0.0, 1.0] }}").design
    assert design.points == 3 * 16
    for name, low, width in (("b", 10.0, 10.0), ("luck", 0.0, 1.0)):
        draws = [design.values(n)[name] for n in range(16)]
        assert sorted(int(16 * (draw - low) / width) for draw in draws) == list(range(16))


def test_random_samples_fill_their_range(tmp_path):
    design = loaded(tmp_path, more="samples = 400", factors=B).design
    draws = [design.values(n)["b"] for n in range(400)]
    assert np.mean(draws) == pytest.approx(15.0, abs=0.5)
    assert np.std(draws) == pytest.approx(10.0 / np.sqrt(12.0), rel=0.1)


def test_distributions_have_their_quantiles(tmp_path):
    factors = (
        "b = { normal = [5.0, 2.0] }\nluck = { log_uniform = [0.01, 1.0] }\n"
        '"cars.nigel.body.mass" = { std = 2.0 }\n"radio.loss" = { normal = [0.0, 1.0] }'
    )
    b, luck, mass, loss = loaded(tmp_path, factors=factors).design.drawn
    assert value_at(b, 0.5) == pytest.approx(5.0)
    assert value_at(b, 0.8413447) == pytest.approx(7.0, abs=1e-4)
    assert value_at(luck, 0.5) == pytest.approx(0.1)
    quantity = load_car("nigel").quantity("body.mass_kg")
    assert value_at(mass, 0.5) == pytest.approx(quantity.value)
    assert value_at(mass, 0.8413447) == pytest.approx(quantity.value + 2.0 * quantity.std, rel=1e-3)
    assert value_at(loss, 0.5) == pytest.approx(0.0)


def test_normal_draws_stay_within_a_number_s_bounds(tmp_path):
    factors = '"network.drop" = { normal = [0.0, 1.0] }'
    (drop,) = loaded(tmp_path, factors=factors).design.drawn
    assert value_at(drop, 1e-9) == pytest.approx(0.0, abs=1e-6)
    assert value_at(drop, 1.0 - 1e-9) == pytest.approx(1.0, abs=1e-6)
    assert 0.3 < value_at(drop, 0.5) < 0.5


def test_a_factor_with_each_is_drawn_for_each_match(tmp_path):
    factors = '"lights.*.yaw" = { normal = [0.0, 0.1], each = true, apply = "add" }'
    study = loaded(tmp_path, factors=factors)
    values = study.design.values(0)
    yaws = [value for path, value in values.items() if path.startswith("lights.")]
    assert len(set(yaws)) == len(yaws) == len(study.base.city_map.lights)
    turned = study.case(0).map.lights
    for light, before, by in zip(turned, study.base.city_map.lights, yaws, strict=True):
        assert light.yaw_rad == pytest.approx(before.yaw_rad + by)
