"""What stands on each wheel is the whole car's doing: its centre of gravity, wheels included."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from tests.every_effect import car_with

MOVED = {
    "com_shift": {"com_shift.shift_m": 0.045},
    "payload": {"payload.mass_kg": 0.8},
    "load_transfer": {"load_transfer.height_m": 0.02},
}
CARS = [(name, ()) for name in ("nigel", "f1tenth", "dart")] + [
    (name, moved) for name in ("nigel", "f1tenth") for moved in (("com_shift",), tuple(MOVED))
]


def standing(name, moved=(), **numbers):
    offsets = {key: value for effect in moved for key, value in MOVED[effect].items()}
    car = car_with(moved, offsets, name) if moved else load_car(name)
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.3))
    for key, value in numbers.items():
        fleet.set_parameter(0, key, value)
    fleet.place(0, Pose2(0.0, 0.0, 0.3))
    return fleet


def statics(fleet):
    """Return the load of a front and of a rear wheel at rest [N]."""
    shape = fleet.shape(0)
    front = shape.cog_to_rear_axle / fleet.car.value("body.wheelbase_m")
    weight = 0.5 * shape.mass * GRAVITY
    return np.array([front, front, 1.0 - front, 1.0 - front]) * weight


@pytest.mark.parametrize(("name", "moved"), CARS)
@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_wheels_carry_the_whole_cars_weight_about_its_centre_of_gravity(name, moved, seconds):
    fleet = standing(name, moved)
    fleet.advance(seconds)
    np.testing.assert_allclose(fleet.wheel_load[0], statics(fleet), atol=1e-9)


@pytest.mark.parametrize(("name", "moved"), CARS)
def test_a_car_at_rest_neither_pitches_nor_heaves(name, moved):
    fleet = standing(name, moved)
    fleet.advance(1e-3)
    first = [fleet.accel_z[0], fleet.pitch_accel[0], fleet.roll_accel[0]]
    assert np.abs(first).max() < 1e-9  # springs balance the body about its own centre of gravity
    fleet.advance(10.0)
    assert np.abs([fleet.z[0], fleet.pitch[0], fleet.roll[0]]).max() < 1e-12


def test_a_car_settled_on_uneven_heights_stands_on_them_at_once():
    fleet = standing("f1tenth", ("com_shift",), wheel_mass=0.3)
    fleet.floor_height[0] = [0.03, 0.02, 0.01, 0.0]
    fleet.place_at_rest(0)
    assert fleet.z[0] == pytest.approx(0.005, abs=1e-12)
    fleet.advance(0.5)
    assert fleet.z[0] == pytest.approx(0.005, abs=1e-9)
    np.testing.assert_allclose(fleet.wheel_load[0], statics(fleet), atol=1e-6)


def turned(wheel_mass):
    fleet = standing("f1tenth", ("com_shift",), wheel_mass=wheel_mass)
    fleet.throttle[0], fleet.steering[0] = 0.5, 0.3
    fleet.advance(20.0)
    return fleet


def test_a_steady_turn_does_not_ask_where_the_wheels_share_of_the_mass_is():
    light, heavy = turned(0.02), turned(0.3)
    curvature = [float(fleet.yaw_rate[0] / fleet.speed[0]) for fleet in (light, heavy)]
    assert curvature[0] == pytest.approx(curvature[1], rel=1e-7)
    assert light.speed[0] == pytest.approx(heavy.speed[0], rel=1e-7)
    np.testing.assert_allclose(light.wheel_load[0], heavy.wheel_load[0], rtol=1e-6)


def test_a_steady_turn_moves_load_by_the_whole_cars_moment():
    fleet = turned(0.3)
    shape, car, load = fleet.shape(0), fleet.car, fleet.wheel_load[0]
    moment = shape.mass * shape.cog_height
    along = moment * float(fleet.accel_x[0]) / car.value("body.wheelbase_m")
    across = moment * float(fleet.accel_y[0]) / car.value("body.track_m")
    assert abs(along) > 0.1
    assert across > 2.0  # newtons: the turn is a real one
    front = statics(fleet)[:2].sum()
    assert load[:2].sum() == pytest.approx(front - along, rel=1e-4)
    assert load[[1, 3]].sum() - load[[0, 2]].sum() == pytest.approx(2.0 * across, rel=1e-4)
