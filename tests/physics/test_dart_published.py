"""The DART car does what its authors' published equations say."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet

THROTTLES = (0.22, 0.26, 0.30, 0.35)


def published_force(throttle, speed):
    """Drive force less friction [N], as the authors print it."""
    beyond = throttle - 0.1638
    drive = (25.36 - 4.815 * speed) * 0.5 * (math.tanh(100 * beyond) + 1) * beyond
    return drive - (1.266 * math.tanh(7.67 * speed) + 0.739 * speed - 0.112 * speed**2)


@pytest.fixture
def dart():
    return load_car("dart")


def test_steady_speeds_solve_the_published_force_balance(dart):
    fleet = Fleet(dart, len(THROTTLES))
    for row, throttle in enumerate(THROTTLES):
        fleet.throttle[fleet.add(Pose2(0.0, 0.0, 0.0))] = throttle
        fleet.steering[row] = -dart.value("steering.map_offset")  # the command that goes straight
    fleet.advance(15.0)
    published = [brentq(lambda v, u=u: published_force(u, v), 1e-6, 5.0) for u in THROTTLES]
    np.testing.assert_allclose(fleet.speed, published, rtol=0.02)
    np.testing.assert_allclose(fleet.yaw, 0.0, atol=1e-6)


def test_a_throttle_step_arrives_with_the_published_lag(dart):
    fleet = Fleet(dart, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0), speed=1.5)
    fleet.throttle[0] = 0.6
    fleet.advance(0.0843)
    arrived = 0.6 * (1 - math.exp(-1))
    turning = 4 * dart.value("wheel.spin_inertia_kgm2") / dart.value("wheel.radius_m") ** 2
    mass = dart.value("body.mass_kg") + turning
    expected = published_force(arrived, float(fleet.speed[0])) / mass
    assert fleet.accel_x[0] == pytest.approx(expected, rel=0.05)


LEFT = 0.366 * math.tanh(1.393 * (0.5 - 0.027))
RIGHT = 0.515 * math.tanh(1.023 * (-0.5 - 0.027))


@pytest.mark.parametrize(("command", "angle"), [(0.5, LEFT), (-0.5, RIGHT)])
def test_steering_settles_on_the_published_curve_of_its_side(dart, command, angle):
    fleet = Fleet(dart, 1)
    fleet.steering[fleet.add(Pose2(0.0, 0.0, 0.0))] = command
    fleet.advance(0.1285)
    assert fleet.steer_angle[0] == pytest.approx(angle * (1 - math.exp(-1)), rel=0.01)
    fleet.advance(3.0)
    assert fleet.steer_angle[0] == pytest.approx(angle, rel=1e-6)
