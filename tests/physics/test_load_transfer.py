"""Loads, roll and pitch come out of the suspension as statics say."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet


@pytest.fixture(scope="module", params=[0.3, -0.3])
def turning(request):
    fleet = Fleet(load_car("f1tenth"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0], fleet.steering[0] = 0.5, request.param
    fleet.advance(20.0)
    return fleet


def lateral_acceleration(fleet):
    return float(fleet.speed[0] * fleet.yaw_rate[0])


def test_the_whole_weight_stands_on_the_wheels(turning):
    weight = turning.car.value("body.mass_kg") * GRAVITY
    assert turning.wheel_load[0].sum() == pytest.approx(weight, rel=1e-6)


def test_load_moves_outwards_by_mass_times_height_over_track(turning):
    car, load = turning.car, turning.wheel_load[0]
    moved = 0.5 * (load[[1, 3]].sum() - load[[0, 2]].sum())
    mass, height = car.value("body.mass_kg"), car.value("body.cog_height_m")
    expected = mass * lateral_acceleration(turning) * height / car.value("body.track_m")
    assert abs(expected) > 1.0  # newtons: the turn is a real one
    assert moved == pytest.approx(expected, rel=0.03)


def test_the_body_leans_outwards_by_moment_over_roll_stiffness(turning):
    car = turning.car
    spring, tyre = car.value("suspension.spring_n_m"), car.value("tyre.vertical_stiffness_n_m")
    corner = spring * tyre / (spring + tyre)
    stiffness = 4.0 * corner * (0.5 * car.value("body.track_m")) ** 2
    mass, height = car.value("body.mass_kg"), car.value("body.cog_height_m")
    expected = mass * lateral_acceleration(turning) * height / stiffness
    assert turning.roll[0] == pytest.approx(expected, rel=0.03)
    assert np.sign(turning.roll[0]) == np.sign(turning.steering[0])  # left turn: left side up


def test_accelerations_are_those_of_the_turn(turning):
    assert turning.accel_y[0] == pytest.approx(lateral_acceleration(turning), rel=0.03)


def test_the_nose_rises_when_starting_and_dives_when_braking():
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[0] = 1.0
    fleet.advance(0.05)
    assert fleet.accel_x[0] > 0.5
    assert fleet.pitch[0] < -1e-4
    fleet.advance(2.0)
    fleet.throttle[0] = 0.0
    fleet.advance(0.03)
    assert fleet.accel_x[0] < -0.5
    assert fleet.pitch[0] > 1e-3
    front, rear = fleet.wheel_load[0, :2].sum(), fleet.wheel_load[0, 2:].sum()
    assert front > rear


def test_braking_moves_load_forward_by_mass_times_height_over_wheelbase():
    car = load_car("f1tenth")
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0), speed=3.0)
    fleet.set_parameter(0, "hold_torque", 0.15)  # firm, but the wheels still roll
    rest = fleet.wheel_load[0, :2].sum()
    fleet.advance(0.4)
    slowing, loads = [], []
    for _ in range(200):
        fleet.advance(1e-3)
        slowing.append(-fleet.accel_x[0])
        loads.append(fleet.wheel_load[0, :2].sum())
    mass, height = car.value("body.mass_kg"), car.value("body.cog_height_m")
    expected = mass * np.mean(slowing) * height / car.value("body.wheelbase_m")
    assert fleet.speed[0] > 0.1
    assert np.mean(loads) - rest == pytest.approx(expected, rel=0.05)
