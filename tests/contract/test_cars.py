"""Every car shipped keeps its contract: it loads, its numbers are the shared ones, it can drive."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import STANDARD_TERMS, TYPES_DIR, car_names, load_car
from scm.vehicles.compiler.assemble import write_page
from scm.vehicles.describe import describe_car
from scm.vehicles.fleet import Fleet

SHARED = Path(__file__).parents[3] / "shared" / "cars"


@pytest.mark.parametrize("name", car_names())
def test_a_car_is_named_like_its_file(name):
    assert load_car(name).name == name


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
def test_the_numbers_are_the_shared_ones(name):
    shared = SHARED / f"{name}.toml"
    if not shared.is_file():
        pytest.skip(f"{shared} is not here: the shared car files are not part of this repository")
    theirs = tomllib.loads(shared.read_text(encoding="utf-8"))
    ours = tomllib.loads((TYPES_DIR / f"{name}.toml").read_text(encoding="utf-8"))
    assert tuple(ours.pop("terms")) == STANDARD_TERMS
    for section, keys in theirs.items():
        known = ours[section]
        of_ours = {key: known[key] for key in keys} if isinstance(keys, dict) else known
        assert of_ours == keys  # ours may say more of the devices


@pytest.mark.parametrize("name", car_names())
def test_every_number_of_a_car_has_a_source(name):
    for key, quantity in load_car(name).values.items():
        assert quantity.source, key


@pytest.mark.parametrize("name", car_names())
def test_a_car_drives_forward_turns_left_and_stays_on_its_wheels(name):
    fleet = Fleet(load_car(name), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0], fleet.steering[0] = 0.5, 0.5
    fleet.advance(1.0)
    assert fleet.x[0] > 0.1
    assert fleet.yaw[0] > 0.05
    assert fleet.status[0] == 0
    assert np.all(fleet.wheel_load > 0.0)


@pytest.mark.parametrize("name", car_names())
def test_the_text_of_a_car_names_every_effect_and_parameter(name):
    car = load_car(name)
    text = describe_car(car)
    further = {part.name for term in car.terms for part in term.also}
    for term in car.terms:
        assert f"\n  {term.name} " in text or term.name in further
        for param in term.params:
            assert f"\n    {param.key.partition('.')[2]} " in text


@pytest.mark.parametrize("name", car_names())
def test_the_kernel_page_says_every_law_of_the_car(name):
    car = load_car(name)
    page = write_page(car.terms)
    compile(page, name, "exec")
    for term in car.terms:
        named = term.sets or term.name
        assert re.search(rf"\b{named} = |\b{term.name}_", page), term.name


def test_the_measured_nigel_has_the_numbers_of_its_builders():
    car = load_car("nigel_measured")
    builders = {
        "body.mass_kg": 2.68, "body.yaw_inertia_kgm2": 0.01944, "body.wheelbase_m": 0.14155,
        "body.track_m": 0.14724, "body.cog_to_rear_axle_m": 0.07929, "body.cog_height_m": 0.0993,
        "wheel.radius_m": 0.0325, "tyre.force_extremum": 0.4, "tyre.lateral_force_extremum": 0.4,
    }  # fmt: skip
    for key, value in builders.items():
        assert car.value(key) == value, key
    assert np.ptp(car.vector("body.footprint_x_m")) == pytest.approx(0.31847, abs=1e-3)
    assert np.ptp(car.vector("body.footprint_y_m")) == pytest.approx(0.175)
    load = car.value("body.mass_kg") * 9.80665 / 4.0
    slope = 1.5 * car.value("tyre.lateral_force_extremum") / car.value("tyre.lateral_slip_extremum")
    assert slope * load == pytest.approx(22.4768, rel=0.002)
