"""What effects add to mass and centre of gravity reaches everybody who asks for them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensors.imu import lever_arm
from scm.vehicles.shape import Shape, shape_of
from scm.world.solids import cog_motion, hull_of, outline
from tests.every_effect import car_with

NIGEL = load_car("nigel")
LADEN = car_with(
    ["payload", "com_shift", "load_transfer"],
    {"payload.mass_kg": 0.6, "com_shift.shift_m": 0.03, "load_transfer.height_m": 0.01},
)


@pytest.fixture(scope="module")
def fleet():
    fleet = Fleet(LADEN, 1)
    fleet.add(Pose2(1.0, 2.0, 0.6))
    return fleet


def test_mass_and_centre_of_gravity_hold_what_effects_add():
    assert shape_of(NIGEL) == Shape(2.4, 0.07077, 0.05)
    assert_allclose(
        [getattr(shape_of(LADEN), name) for name in Shape.__slots__], [3.0, 0.10077, 0.06]
    )


def test_a_row_of_a_fleet_goes_by_its_own_numbers(fleet):
    assert fleet.shape(0) == shape_of(LADEN)
    fleet.parameters[0, fleet.parameter_names.index("shift")] = -0.02
    assert fleet.shape(0).cog_to_rear_axle == pytest.approx(0.05077)
    fleet.parameters[0, fleet.parameter_names.index("shift")] = 0.03


def test_the_contact_body_has_the_cars_pose(fleet):
    hull = hull_of(LADEN)
    assert hull.mass == pytest.approx(3.0)
    x, y, yaw, *_ = fleet.planar_cog(0)
    c, s = np.cos(yaw), np.sin(yaw)
    corner = (x + c * hull.rear - s * hull.right, y + s * hull.rear + c * hull.right)
    assert_allclose(corner, outline(LADEN, np.array([[1.0, 2.0, 0.6]]))[0, :2], atol=1e-9)


def test_a_reported_motion_is_moved_to_the_true_centre_of_gravity(fleet):
    moved = cog_motion(
        shape_of(LADEN).cog_to_rear_axle, np.array([[1.0, 2.0, 0.6, 0.0, 0.0, 0.0]])
    )[0]
    assert_allclose(moved, fleet.planar_cog(0), atol=1e-9)


def test_the_imu_stays_where_it_is_mounted_when_the_centre_of_gravity_moves():
    assert_allclose(lever_arm(NIGEL) - lever_arm(LADEN), [0.03, 0.0, 0.01], atol=1e-15)
