"""The nominal Nigel does what is published of it."""

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet

ANGLES = (-1.0, -0.7, -0.4, -0.2, -0.1, 0.1, 0.2, 0.4, 0.7, 1.0)


@pytest.fixture(scope="module")
def nigel():
    return load_car("nigel")


def test_steady_speed_is_the_published_one_at_every_throttle(nigel):
    fleet = Fleet(nigel, 10)
    for i in range(10):
        fleet.throttle[fleet.add(Pose2(0.0, 0.0, 0.0))] = 0.0
        fleet.throttle[i] = (i + 1) / 10
    fleet.advance(8.0)
    published = nigel.vector("drive.throttle_speed_m_s")
    np.testing.assert_allclose(fleet.speed, published, rtol=0.01)


def test_backwards_it_reaches_the_same_speeds_and_forward_again_after_a_knock(nigel):
    published = np.array(nigel.vector("drive.throttle_speed_m_s"))
    throttle = np.arange(1, 11) / 10
    fleet = Fleet(nigel, 10)
    for _ in range(10):
        fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[:] = -throttle
    fleet.advance(8.0)
    np.testing.assert_allclose(-fleet.speed, published, rtol=0.01)
    assert np.abs(fleet.y).max() < 1e-9
    fleet.throttle[:] = throttle
    for row in range(10):
        fleet.push(row, -0.3, 0.1, 0.5)
    fleet.advance(8.0)
    np.testing.assert_allclose(fleet.speed, published, rtol=0.01)


def test_backwards_left_wheels_turn_the_tail_left_on_the_same_circle_and_zero_throttle_holds(nigel):
    fleet = Fleet(nigel, 4)
    for row, steering in enumerate((1.0, 0.4, -0.4, -1.0)):
        fleet.add(Pose2(0.0, 0.0, 0.0))
        fleet.throttle[row], fleet.steering[row] = -0.36, steering
    fleet.advance(20.0)
    radius = fleet.speed / fleet.yaw_rate
    geometry = nigel.value("body.wheelbase_m") / np.tan(fleet.steer_angle)
    np.testing.assert_allclose(radius, geometry, rtol=0.02)
    assert np.array_equal(np.sign(fleet.yaw_rate), [-1.0, -1.0, 1.0, 1.0])
    fleet.throttle[:] = 0.0
    fleet.advance(2.0)
    before = [fleet.pose(row) for row in range(4)]
    fleet.advance(10.0)
    assert np.abs(np.array([fleet.pose(row) for row in range(4)]) - before).max() < 1e-9


@pytest.fixture(scope="module")
def circles(nigel):
    fleet = Fleet(nigel, len(ANGLES))
    for i, steering in enumerate(ANGLES):
        fleet.add(Pose2(0.0, 0.0, 0.0))
        fleet.throttle[i], fleet.steering[i] = 0.36, steering
    fleet.advance(20.0)
    return fleet


def test_at_walking_pace_the_radius_is_the_wheelbase_over_the_tangent(nigel, circles):
    np.testing.assert_allclose(circles.speed, 0.1, rtol=0.03)
    radius = circles.speed / circles.yaw_rate
    geometry = nigel.value("body.wheelbase_m") / np.tan(circles.steer_angle)
    np.testing.assert_allclose(radius, geometry, rtol=0.02)


def test_the_inner_wheel_turns_more_on_both_sides(circles):
    left, right = circles.wheel_steer[:, 0], circles.wheel_steer[:, 1]
    turning_left = np.array(ANGLES) > 0
    assert np.all((left > right)[turning_left])
    assert np.all((-right > -left)[~turning_left])
    assert np.all(np.abs(left[turning_left]) > circles.steer_angle[turning_left])


def test_positive_steering_turns_left(circles):
    assert np.array_equal(np.sign(circles.yaw_rate), np.sign(ANGLES))


def test_the_servo_moves_no_faster_than_its_rate(nigel):
    fleet = Fleet(nigel, 1)
    fleet.steering[fleet.add(Pose2(0.0, 0.0, 0.0))] = 1.0
    fleet.advance(0.5)
    assert fleet.steer_angle[0] == pytest.approx(0.5 * nigel.value("steering.rate_rad_s"))
    fleet.advance(2.0)
    assert fleet.steer_angle[0] == nigel.value("steering.limit_rad")


def test_zero_throttle_stops_the_car_and_never_reverses_it(nigel):
    fleet = Fleet(nigel, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0), speed=0.26)
    slowest_wheel, path = 0.0, []
    for _ in range(300):
        fleet.advance(1e-3)
        path.append(float(fleet.x[0]))
        slowest_wheel = min(slowest_wheel, float(fleet.wheel_speed[0, 2:].min()))
    assert slowest_wheel == 0.0
    assert max(path) - path[-1] < 2e-5  # the springs unload through the tyres' creep: microns
    assert abs(fleet.speed[0]) < 1e-4
    assert path[-1] < 0.02


@pytest.mark.parametrize("name", ["nigel", "f1tenth", "dart"])
def test_a_car_at_rest_sits_still_for_a_minute(name):
    fleet = Fleet(load_car(name), 3)
    poses = [Pose2(0.0, 0.0, 0.0), Pose2(3.0, -2.0, 2.5), Pose2(-7.0, 1.0, -2.0)]
    for pose in poses:
        fleet.add(pose)
    fleet.steering[2] = 0.6  # turning the wheels at rest moves nothing either
    fleet.advance(60.0)
    moved = np.column_stack([fleet.x, fleet.y, fleet.yaw]) - np.array(poses)
    assert np.abs(moved).max() < 1e-6
    assert np.abs(fleet.z).max() < 1e-6


def test_a_car_that_has_stopped_sits_still_too(nigel):
    fleet = Fleet(nigel, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0), speed=0.2)
    fleet.steering[0] = 0.5
    fleet.advance(3.0)
    before = fleet.pose(0)
    fleet.advance(60.0)
    assert np.abs(np.array(fleet.pose(0)) - np.array(before)).max() < 1e-6
