"""The IMU feels gravity through the tilt, the car's acceleration, and its own lever arm."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.sensors.imu import SENSOR, lever_arm

NIGEL = load_car("nigel")
NAMES = [
    "roll",
    "pitch",
    "roll_rate",
    "pitch_rate",
    "yaw_rate",
    "yaw_accel",
    "accel_x",
    "accel_y",
    "accel_z",
]


def felt(**motion):
    truth = SimpleNamespace(**{name: np.array([motion.get(name, 0.0)]) for name in NAMES})
    return SENSOR.measure(NIGEL, truth, np.array([0]), None)[0]


def test_at_rest_it_feels_gravity_upwards_and_no_turn():
    assert_allclose(felt(), [0, 0, GRAVITY, 0, 0, 0], atol=1e-15)


def test_nose_down_gravity_pulls_forward_so_the_force_is_backward():
    assert felt(pitch=0.1)[0] == pytest.approx(-GRAVITY * np.sin(0.1))


def test_left_side_up_the_force_is_to_the_left():
    assert felt(roll=0.1)[1] == pytest.approx(GRAVITY * np.sin(0.1))


def test_tilting_changes_no_force_in_size():
    force = felt(roll=0.2, pitch=-0.3, accel_x=1.0, accel_y=2.0)[:3]
    assert np.linalg.norm(force) == pytest.approx(np.sqrt(1 + 4 + GRAVITY**2))


def test_turning_in_place_throws_outwards_from_the_centre_of_gravity():
    x, y, _ = lever_arm(NIGEL)
    assert_allclose(felt(yaw_rate=3.0)[:2], [-9.0 * x, -9.0 * y], atol=1e-12)


def test_spinning_up_pushes_across_the_lever_arm():
    x, y, _ = lever_arm(NIGEL)
    assert_allclose(felt(yaw_accel=5.0)[:2], [-5.0 * y, 5.0 * x], atol=1e-12)


def test_the_gyro_reads_the_turn_rates_in_order():
    assert_allclose(felt(roll_rate=0.1, pitch_rate=0.2, yaw_rate=0.3)[3:], [0.1, 0.2, 0.3])
