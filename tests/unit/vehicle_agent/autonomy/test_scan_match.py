"""A sweep is matched to a map from a poor guess, with a true covariance, and past outliers."""

import time

import numpy as np
import pytest

from bench.autonomy_mapping import MOUNT, Lap, drive
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.segments import wall_segments
from vehicle_agent.autonomy.faces import field_of
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.scan_match import Window, match
from vehicle_agent.autonomy.sweep import Twist, deskewed

NOISE_M = 0.01


@pytest.fixture(scope="module")
def room():
    city_map = load_map("parking_school_obstacles")
    return grid_of_city(city_map), wall_segments(city_map)


@pytest.fixture(scope="module")
def points(room):
    """Of a car that stands."""
    pose, sweep = next(drive(room[1], Lap(), NOISE_M, 1.0))
    return pose, deskewed(sweep, MOUNT, Twist())


def errors(found, pose):
    return np.array(found.pose) - np.array(pose)  # map frame, as the covariance


def test_a_guess_is_corrected_from_anywhere_in_the_window(room, points):
    pose, seen = points
    rng = np.random.default_rng(3)
    for _ in range(20):
        x, y, yaw = rng.uniform(-1.0, 1.0, 3) * (0.15, 0.15, 0.15)
        found = match(seen, room[0], Pose2(pose.x + x, pose.y + y, pose.yaw + yaw))
        assert np.abs(errors(found, pose)).max() < 0.008
        assert found.score > 0.97


def test_the_covariance_is_that_of_the_errors(room):
    stand = Lap(time_s=1e9)
    squares, claimed = [], []
    for seed in range(60):
        pose, sweep = next(drive(room[1], stand, NOISE_M, 1.0, seed=seed))
        found = match(deskewed(sweep, MOUNT, Twist()), room[0], pose, None)
        squares.append(errors(found, pose) ** 2)
        claimed.append(np.diag(found.covariance))
    ratio = np.mean(squares, axis=0) / np.mean(claimed, axis=0)
    assert (ratio > 0.3).all()
    assert (ratio < 2.5).all()


def test_a_third_of_outliers_moves_the_pose_by_millimetres(room, points):
    pose, seen = points
    seen, rng = seen.copy(), np.random.default_rng(4)
    seen[100:220] *= rng.uniform(0.5, 0.7, (120, 1))  # a person stands in the way
    found = match(seen, room[0], Pose2(pose.x + 0.08, pose.y - 0.08, pose.yaw + 0.1))
    assert np.abs(errors(found, pose)).max() < 0.012
    assert 0.55 < found.score < 0.85


def test_along_a_corridor_the_guess_holds_and_the_covariance_is_great():
    walls = np.array([[-5.0, 0.5, 5.0, 0.5], [-5.0, -0.5, 5.0, -0.5]])
    x = np.linspace(-1.5, 1.5, 150)
    seen = np.vstack((np.column_stack((x, 0.5 + 0 * x)), np.column_stack((x, -0.5 + 0 * x))))
    found = match(seen, field_of(walls), Pose2(0.3, 0.05, 0.05))
    assert abs(found.pose.x - 0.3) < 0.03
    assert abs(found.pose.y) < 0.002
    assert abs(found.pose.yaw) < 0.002
    assert found.covariance[0, 0] > 1e3 * found.covariance[1, 1]


def test_too_few_points_keep_the_guess(room):
    guess = Pose2(0.1, 0.2, 0.3)
    found = match(np.ones((3, 2)), room[0], guess)
    assert found.pose == guess
    assert found.covariance[0, 0] == pytest.approx(1e6)


def test_a_match_of_360_points_takes_less_than_5_ms(room, points):
    pose, seen = points
    match(seen, room[0], pose)
    times = []
    for _ in range(9):
        start = time.perf_counter()
        match(seen, room[0], pose, Window(0.15, 0.15))
        times.append(time.perf_counter() - start)
    assert min(times) < 0.005
