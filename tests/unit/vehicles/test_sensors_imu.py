"""The IMU feels gravity through the tilt, the car's acceleration, and its own lever arm."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from scm.geometry import Pose2
from scm.vehicles.body14 import GRAVITY
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.sensors.imu import SENSOR, lever_arm

NIGEL = load_car("nigel")
NAMES = [
    "roll",
    "pitch",
    "roll_rate",
    "pitch_rate",
    "yaw_rate",
    "roll_accel",
    "pitch_accel",
    "yaw_accel",
    "accel_x",
    "accel_y",
    "accel_z",
    "contact_accel_x",
    "contact_accel_y",
    "contact_yaw_accel",
    "yaw",
]


def felt(**motion):
    truth = SimpleNamespace(**{name: np.array([motion.get(name, 0.0)]) for name in NAMES})
    return SENSOR.measure(NIGEL, truth, np.array([0]), None)[0]


def test_at_rest_it_feels_gravity_upwards_and_no_turn():
    assert_allclose(felt(), [0, 0, GRAVITY, 0, 0, 0, 0, 0, 0], atol=1e-15)


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
    assert_allclose(felt(roll_rate=0.1, pitch_rate=0.2, yaw_rate=0.3)[3:6], [0.1, 0.2, 0.3])


def test_the_orientation_is_roll_pitch_and_yaw():
    assert_allclose(felt(roll=0.1, pitch=0.2, yaw=0.3)[6:], [0.1, 0.2, 0.3])


def test_a_contact_is_felt_through_the_lever_arm():
    x, y, _ = lever_arm(NIGEL)
    force = felt(contact_accel_x=-20.0, contact_accel_y=3.0, contact_yaw_accel=50.0)
    assert_allclose(force[:2], [-20.0 - 50.0 * y, 3.0 + 50.0 * x])


@pytest.mark.parametrize("name", ["nigel", "f1tenth"])
def test_the_force_is_that_of_the_path_which_the_imu_itself_takes(name):
    car = load_car(name)
    fleet, dt, path, frames, forces = Fleet(car, 1), 1e-3, [], [], []
    fleet.add(Pose2(0.0, 0.0, 0.3))
    fleet.steering[0] = 0.5
    for i in range(300):
        fleet.throttle[0] = (1.0, 0.0, -1.0)[i // 100]  # launch, stop, launch backwards
        fleet.advance(dt)
        x, y, yaw = fleet.planar_cog(0)[:3]
        roll, pitch = fleet.roll[0], fleet.pitch[0]
        z = fleet.z[0] + car.value("body.cog_height_m")
        z -= pitch * car.value("body.cog_to_rear_axle_m")
        frames.append(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix())
        path.append(np.array([x, y, z]) + frames[-1] @ lever_arm(car))
        forces.append(SENSOR.measure(car, fleet, np.array([0]), None)[0, :3])
    accel = np.diff(path, 2, axis=0) / dt**2 + (0.0, 0.0, GRAVITY)
    expected = np.array([R.T @ a for R, a in zip(frames[1:-1], accel, strict=True)])
    spread = (expected - (0.0, 0.0, GRAVITY)).std(axis=0)
    error = np.sqrt(np.mean((np.array(forces[2:]) - expected) ** 2, axis=0))
    assert (error[[0, 2]] < 0.05 * spread[[0, 2]]).all(), (error, spread)
