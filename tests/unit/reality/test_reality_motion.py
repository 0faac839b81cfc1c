"""The independent reality's car obeys what is known of real cars."""

import math
import tomllib

import numpy as np
import pytest

from tests.reality.motion import ROW_S, STEP, TYRE_STIFFNESS, Moving, steer
from tests.reality.numbers import GRAVITY, TYPES, nominal


def driven(car, seconds, throttle, steering=0.0, **changed):
    """Return the body after some seconds of one command, and the rows of the drive."""
    commands = round(20 * seconds)
    body = Moving(nominal(car) | changed, (0.0, 0.0, 0.0), commands)
    rows = [body.command(k, throttle, steering) for k in range(commands)]
    return body, np.vstack(rows)


@pytest.mark.parametrize("tenth", [1, 3, 5, 8, 10])
def test_nigels_steady_speed_is_that_of_its_table(tenth):
    data = tomllib.loads((TYPES / "nigel.toml").read_text(encoding="utf-8"))
    table = data["drive"]["throttle_speed_m_s"]["value"]
    body, _ = driven("nigel", 6.0, tenth / 10)
    assert body.state["vx"][0] == pytest.approx(table[tenth - 1], rel=0.015)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slow_circle_has_nearly_the_wheelbase_formulas_radius(side):
    body, _ = driven("f1tenth", 15.0, 0.1, 0.6 * side)
    numbers = nominal("f1tenth")
    radius = numbers["base"] / math.tan(0.6 * side * numbers["limit"])
    turned = body.state["vx"][0] / body.state["yaw_rate"][0]
    assert turned == pytest.approx(radius, rel=0.05)
    assert abs(turned) > abs(radius)  # tyres slip, and motors of their own hold the axle straight


def test_mirrored_steering_gives_the_mirrored_drive():
    _, left = driven("f1tenth", 5.0, 0.4, 0.5)
    _, right = driven("f1tenth", 5.0, 0.4, -0.5)
    np.testing.assert_allclose(left[:, 2], -right[:, 2], atol=1e-9)


def test_a_car_without_throttle_stays_where_it_is():
    body, rows = driven("nigel", 3.0, 0.0, 1.0)
    assert np.abs(rows[:, 1:8]).max() == 0.0
    assert body.state["servo"][0] == pytest.approx(nominal("nigel")["limit"])


def test_coasting_never_gains_energy():
    numbers = nominal("f1tenth") | {"hold": 0.0, "stall": 0.0}
    body = Moving(numbers, (0.0, 0.0, 0.0), 100)
    body.state["vx"], body.state["vy"], body.state["yaw_rate"] = 2.0, 0.3, 1.5
    body.wheels[:, 0] = 2.0 / numbers["radius"]
    energy = []
    for k in range(100):
        body.command(k, 0.0, 0.5)
        s = body.state[0]
        spin = numbers["spin_inertia"] + numbers["rotor"]
        energy.append(
            0.5 * numbers["mass"] * (s["vx"] ** 2 + s["vy"] ** 2)
            + 0.5 * numbers["inertia"] * s["yaw_rate"] ** 2
            + 0.5 * spin * float(np.sum(body.wheels[:, 0] ** 2))
        )
    assert np.all(np.diff(energy) <= 1e-9)
    assert energy[-1] < 0.5 * energy[0]


def test_a_push_on_a_rolling_car_follows_newton():
    loose = {"hold": 0.0, "stall": 1e-9, "coulomb": 0.0, "rolling": 0.0, "damping": 0.0,
             "wind_x": 1.0}  # fmt: skip
    body, _ = driven("f1tenth", 1.0, 0.0, 0.0, **loose)
    numbers = nominal("f1tenth")
    turning = 4.0 * (numbers["spin_inertia"] + numbers["rotor"]) / numbers["radius"] ** 2
    expected = 1.0 / (numbers["mass"] + turning)
    assert body.state["vx"][0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("changed", "slower"),
    [({"sag": 0.5}, True), ({"drag_linear": 5.0}, True), ({"drive_gain": 1.2}, False),
     ({"rolling": 0.1}, True), ({"fade": 0.4}, True), ({"radius": 0.035}, False)],
)  # fmt: skip
def test_effects_of_the_drive_change_its_speed_the_right_way(changed, slower):
    usual, _ = driven("nigel", 10.0, 0.6)
    other, _ = driven("nigel", 10.0, 0.6, **changed)
    assert bool(other.state["vx"][0] < 0.995 * usual.state["vx"][0]) is slower


@pytest.mark.parametrize(
    "changed",
    [{"trim": 0.03}, {"asymmetry": -0.2}, {"weave": 0.05, "weave_period": 60.0},
     {"steer_per_speed": 0.1}],
)  # fmt: skip
def test_effects_of_the_steering_turn_a_straight_drive_left(changed):
    _, rows = driven("nigel", 10.0, 0.6, **changed)
    assert rows[-1, 3] > 0.01


def test_wheels_that_give_way_turn_as_fast_as_the_servo_where_nothing_presses_them():
    for commands in (1, 2, 3):
        body, _ = driven("f1tenth", commands / 20, 0.0, 1.0, give=0.2)
        assert body.state["angle"][0] == pytest.approx(body.state["servo"][0], abs=1e-9)


def test_wheels_give_way_in_the_end_by_their_side_force():
    body, _ = driven("f1tenth", 8.0, 0.4, 0.4, give=0.2)
    s, numbers = body.state[0], nominal("f1tenth")
    gives = 0.2 * s["front_side"] / (numbers["mass"] * GRAVITY)
    assert s["servo"] - s["angle"] == pytest.approx(gives, rel=1e-3)
    assert gives > 0.01


def test_wheels_give_way_within_ten_milliseconds():
    body = Moving(nominal("f1tenth") | {"give": 0.2}, (0.0, 0.0, 0.0), 1)
    s = body.state[0]
    s["front_side"] = 0.5 * nominal("f1tenth")["mass"] * GRAVITY
    for _ in range(round(0.01 / STEP)):
        steer(body.numbers[0], s, 0.0, 0.0, 0.0)
    assert s["angle"] == pytest.approx(-0.1, rel=0.1)


@pytest.mark.parametrize("car", ["nigel", "f1tenth"])
def test_a_body_leans_out_of_a_circle_by_what_its_springs_give(car):
    body, rows = driven(car, 12.0, 0.35, 0.3)
    numbers = nominal(car)
    spring = 1.0 / (1.0 / numbers["spring"] + 1.0 / TYRE_STIFFNESS)
    moment = numbers["mass"] * rows[-1, 8] * numbers["height"]
    leans = moment / (spring * numbers["track"] ** 2)
    assert body.state["roll"][0] == pytest.approx(leans, rel=0.01)
    assert body.state["roll"][0] > 0.0


def test_a_launch_lifts_the_nose_and_loads_the_rear():
    body, _ = driven("f1tenth", 0.2, 0.5)
    assert body.state["pitch"][0] < -0.003
    squeeze = body.wheels[:, 4]
    assert squeeze[2] > 0.0 > squeeze[0]
    assert abs(squeeze.sum()) < 0.1 * np.abs(squeeze).sum()


def test_a_body_that_leans_answers_steering_later_across_than_one_on_rails():
    def pushed(**changed):
        numbers = nominal("f1tenth") | changed
        body = Moving(numbers, (0.0, 0.0, 0.0), 100)
        return np.vstack([body.command(k, 0.4, 0.3 * (k >= 95)) for k in range(100)])[950 * 2 :, 8]

    soft, hard = pushed(), pushed(roll_inertia=10.0)
    assert hard[4] > 1.1 * soft[4]


def test_a_rows_accelerations_are_those_of_its_end():
    numbers = nominal("f1tenth") | {"steer_lag": 0.05}
    body = Moving(numbers, (0.0, 0.0, 0.0), 60)
    rows = np.vstack([body.command(k, 0.4, 0.3 * math.sin(0.3 * k)) for k in range(60)])[400:]
    changes = np.gradient(rows[:, 5], ROW_S) + rows[:, 6] * rows[:, 4]
    off, late = rows[1:-1, 8] - changes[1:-1], rows[:-2, 8] - changes[1:-1]
    assert np.std(off) < 0.3 * np.std(late)
