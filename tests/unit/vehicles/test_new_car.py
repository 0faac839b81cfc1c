"""A car file from a few figures drives as the figures say, and says how sure each number is."""

import re
from pathlib import Path

import numpy as np
import pytest

from scm.errors import CarError
from scm.geometry import Pose2
from scm.vehicles.car import car_of_text, load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.new_car import LIKE, Figures, new_car_text

STEP_S = 0.001


def figures(**changes):
    given = {
        "name": "mine", "scale": "1:10", "mass_kg": 3.2, "wheelbase_m": 0.324, "motor": "direct",
        "top_speed_mps": 6.0,
    }  # fmt: skip
    return Figures(**{**given, **changes})


def made(**changes):
    return car_of_text(new_car_text(figures(**changes)), Path("mine.toml"))


def speeds(car, throttle, seconds):
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    commands = np.full((round(seconds / STEP_S), 1), throttle)
    return fleet.rollout(commands, np.zeros_like(commands), STEP_S, ("speed",))["speed"][:, 0]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"motor": "geared", "top_speed_mps": 0.27, "mass_kg": 2.4, "wheelbase_m": 0.1415},
        {"mass_kg": 0.6, "wheelbase_m": 0.15, "top_speed_mps": 3.0, "driven": "all"},
        {"mass_kg": 14.0, "wheelbase_m": 0.6, "top_speed_mps": 12.0, "width_m": 0.4},
    ],
)
def test_it_reaches_its_top_speed_and_the_values_in_its_table(changes):
    car = made(**changes)
    top = figures(**changes).top_speed_mps
    assert speeds(car, 1.0, 15.0)[-1] == pytest.approx(top, rel=0.02)
    half = car.vector("drive.throttle_speed_m_s")[4]
    assert speeds(car, 0.5, 15.0)[-1] == pytest.approx(half, rel=0.05)


def test_it_accelerates_as_was_measured():
    speed = speeds(made(acceleration_mps2=3.0), 1.0, 0.3)
    assert (speed[200] - speed[50]) / 0.15 == pytest.approx(3.0, rel=0.15)


def test_a_geared_car_holds_and_a_direct_one_can_be_pushed():
    weight_n = 3.2 * 9.80665

    def held(motor):
        car = made(motor=motor)
        return 2.0 * car.value("drive.hold_torque_nm") / car.value("wheel.radius_m") / weight_n

    assert held("geared") > 0.5
    assert held("direct") < 0.05


def test_what_was_not_measured_is_far_less_sure():
    given = made(track_m=0.25, wheel_radius_m=0.05).quantity
    guessed = made().quantity
    for key in ("body.track_m", "wheel.radius_m"):
        assert given(key).source == "given"
        assert guessed(key).source == "scaled"
        assert guessed(key).std > 5.0 * given(key).std, key
    assert given("body.mass_kg").std == pytest.approx(0.032)


@pytest.mark.parametrize("name", LIKE)
def test_estimates_hold_for_cars_that_are_known(name):
    """The figures of a known car lead to numbers that are its own, to three deviations."""
    known = load_car(name)
    car = made(
        mass_kg=known.value("body.mass_kg"),
        wheelbase_m=known.value("body.wheelbase_m"),
        length_m=float(np.ptp(known.vector("body.footprint_x_m"))),
        width_m=float(np.ptp(known.vector("body.footprint_y_m"))),
    )
    checked = 0
    for key, quantity in car.values.items():
        if quantity.source == "scaled" and quantity.std and known.has(key):
            assert abs(known.value(key) - quantity.value) < 3.0 * quantity.std, key
            checked += 1
    assert checked > 9


def test_every_number_has_a_source():
    text = new_car_text(figures(lidar=True, camera=True))
    numbers = [line for line in text.splitlines() if re.search(r"= \{", line)]
    assert len(numbers) > 60
    assert all(re.search(r'source = "(given|scaled|assumed|from)', line) for line in numbers)


def test_sensors_are_those_it_has():
    bare = made(tag_size_m=0.0)
    assert not any(bare.has(f"{name}.position_m") for name in ("lidar", "camera", "ips"))
    full = made(lidar=True, camera=True)
    assert all(full.has(f"{name}.position_m") for name in ("lidar", "camera", "ips", "imu"))


def test_a_number_out_of_bounds_is_refused_by_its_key():
    with pytest.raises(CarError, match=r"mine\.toml: body\.wheelbase_m: expected 0\.05 to 5 m"):
        new_car_text(figures(wheelbase_m=9.0))


@pytest.mark.parametrize("acceleration_mps2", [1e-300, 1e-5])
def test_an_acceleration_that_rolling_swallows_is_refused(acceleration_mps2):
    with pytest.raises(CarError, match=r"mine\.toml: acceleration_mps2: .* next to nothing"):
        new_car_text(figures(acceleration_mps2=acceleration_mps2))
