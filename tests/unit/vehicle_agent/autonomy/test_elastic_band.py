from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from scm.geometry import Pose2
from tests.unit.vehicle_agent.autonomy.bends import START, floor, path_of
from vehicle_agent.autonomy import elastic_band
from vehicle_agent.autonomy.band_solver import optimise
from vehicle_agent.autonomy.elastic_band import ElasticBand
from vehicle_agent.autonomy.plan import CarLimits
from vehicle_agent.autonomy.trajectory_check import is_free, motion_errors

LIMITS = CarLimits(
    wheelbase_m=0.1415, steering_rad=0.5236, steering_rate_radps=0.42,
    rear_m=-0.07, front_m=0.23, right_m=-0.0875, left_m=0.0875,
)  # fmt: skip
NOTHING = np.empty((0, 5))
BEND = 1.0 / 0.26


STRAIGHT = path_of((1.2, 0.0))
CURVES = path_of((0.3, 0.0), (0.4, BEND), (0.5, -BEND))
CUSPS = path_of((0.4, 0.0), (0.3, BEND), (-0.35, -BEND), (0.2, 0.0))


def planned(path, grid=None, moving=NOTHING, band=None):
    band = band or ElasticBand(LIMITS)
    return band.plan(grid or floor(), path, START, 0.0, 0.0, moving, 0.0)


def at(trajectory, t):
    """Return pose, speed and steering at a time, between states linearly."""
    columns = [trajectory.poses[:, p] for p in range(3)]
    columns += [trajectory.speeds_mps, trajectory.steering_rad]
    x, y, yaw, speed, steering = (
        float(np.interp(t, trajectory.times_s, column)) for column in columns
    )
    return Pose2(x, y, yaw), speed, steering


@pytest.mark.parametrize("path", [STRAIGHT, CURVES, CUSPS])
def test_trajectory_reaches_goal_within_limits(path):
    trajectory = planned(path)
    assert is_free(floor(), LIMITS, trajectory, NOTHING)
    place, turn = motion_errors(LIMITS, trajectory)
    assert place.max() < 2e-4
    assert turn.max() < 1e-3
    assert_allclose(trajectory.poses[-1], path.poses[-1], atol=0.005)
    assert trajectory.speeds_mps[-1] == 0.0


def test_straight_is_driven_as_fast_as_speed_and_acceleration_allow():
    least = 1.2 / LIMITS.speed_mps + LIMITS.speed_mps / LIMITS.accel_mps2
    assert_allclose(planned(STRAIGHT).times_s[-1], least, rtol=0.01)


def test_cusps_are_kept_and_the_car_stands_there():
    trajectory = planned(CUSPS)
    moving = trajectory.speeds_mps[np.abs(trajectory.speeds_mps) > 0.01]
    assert_array_equal(np.sign(moving)[np.flatnonzero(np.diff(np.sign(moving)))], [1.0, -1.0])
    stands = (trajectory.speeds_mps[1:] == 0.0) & (trajectory.speeds_mps[:-1] == 0.0)
    assert stands.sum() == 1 + CUSPS.cusps  # at the beginning too


def test_car_that_rolls_against_the_gear_brakes_first():
    path = path_of((-0.3, 0.0))
    trajectory = ElasticBand(LIMITS).plan(floor(), path, START, 0.1, 0.0, NOTHING, 0.0)
    assert is_free(floor(), LIMITS, trajectory, NOTHING)
    assert trajectory.poses[:, 0].max() == pytest.approx(START.x + 0.1**2 / 0.3, abs=0.002)


def test_plan_begins_with_present_speed_and_steering():
    trajectory = ElasticBand(LIMITS).plan(floor(), STRAIGHT, START, 0.12, -0.2, NOTHING, 0.0)
    assert (trajectory.speeds_mps[0], trajectory.steering_rad[0]) == (0.12, -0.2)
    assert is_free(floor(), LIMITS, trajectory, NOTHING)


@pytest.mark.parametrize("side", [-0.05, 0.0, 0.05])
def test_box_on_the_path_is_passed(side):
    grid = floor((1.15, 0.95 + side, 1.25, 1.05 + side))
    trajectory = planned(path_of((1.6, 0.0)), grid)
    assert is_free(grid, LIMITS, trajectory, NOTHING)
    assert trajectory.poses[-1, 0] > 1.4


def test_classes_that_were_compared_are_known_until_the_band_goes_on_alone():
    grid, path, band = floor((1.15, 0.95, 1.25, 1.05)), path_of((1.6, 0.0)), ElasticBand(LIMITS)
    planned(path, grid, band=band)
    beside = [one.poses[:, 1] - 1.0 for one in band.candidates]
    assert len(beside) == 3
    assert max(one.max() for one in beside) > 0.1
    assert min(one.min() for one in beside) < -0.1
    band.plan(floor(), path, START, 0.0, 0.0, NOTHING, 0.1)
    assert band.candidates == ()


def test_blocked_corridor_gives_a_trajectory_that_is_refused():
    grid = floor((0.3, 0.7, 2.8, 0.8), (0.3, 1.2, 2.8, 1.3), (1.2, 0.8, 1.3, 1.2))
    assert not is_free(grid, LIMITS, planned(path_of((1.6, 0.0)), grid), NOTHING)


def test_crossing_obstacle_is_let_pass():
    moving = np.array([[1.3, 1.9, 0.0, -0.17, 0.1]])
    trajectory = planned(STRAIGHT, floor(), moving)
    assert is_free(floor(), LIMITS, trajectory, moving)
    assert not is_free(floor(), LIMITS, planned(STRAIGHT), moving)


def test_oncoming_obstacle_is_passed():
    moving = np.array([[2.3, 1.0, -0.15, 0.0, 0.1]])
    trajectory = planned(path_of((1.6, 0.0)), floor(), moving)
    assert is_free(floor(), LIMITS, trajectory, moving)
    assert np.abs(trajectory.poses[:, 1] - 1.0).max() > 0.1


@pytest.mark.parametrize("path", [CURVES, CUSPS])
def test_next_plan_takes_no_longer_than_what_was_left(path):
    band = ElasticBand(LIMITS)
    before, t = planned(path, band=band), 0.0
    for _ in range(10):
        t += 0.1
        after = band.plan(floor(), path, *at(before, 0.1), NOTHING, t)
        assert is_free(floor(), LIMITS, after, NOTHING)
        assert after.times_s[-1] < before.times_s[-1] - 0.1 + 0.05
        before = after


def test_car_that_follows_its_plans_arrives():
    band, state, t = ElasticBand(LIMITS), (START, 0.0, 0.0), 0.0
    while t < 20.0:
        trajectory = band.plan(floor(), CUSPS, *state, NOTHING, t)
        if trajectory.times_s[-1] < 0.1:
            break
        state, t = at(trajectory, 0.1), t + 0.1
    assert_allclose(state[0], CUSPS.poses[-1], atol=0.01)
    assert t < 15.0


def test_same_input_gives_the_same_bits():
    grid, moving = floor((1.15, 0.9, 1.25, 1.0)), np.array([[2.3, 1.0, -0.15, 0.0, 0.1]])
    one, two = (planned(CUSPS, grid, moving) for _ in range(2))
    for field in ("times_s", "poses", "speeds_mps", "steering_rad"):
        assert_array_equal(getattr(one, field), getattr(two, field))


def test_reversed_left_and_right_gives_the_mirrored_plan():
    mirrored = replace(CURVES, poses=CURVES.poses * (1, -1, -1) + (0, 2, 0))
    one, two = planned(CURVES), planned(mirrored)
    assert_allclose(two.times_s, one.times_s, atol=1e-6)
    assert_allclose(two.steering_rad, -one.steering_rad, atol=1e-6)


def test_slopes_vanish_where_optimising_ends(monkeypatch):
    calls = []
    monkeypatch.setattr(
        elastic_band, "optimise", lambda *given: calls.append(given) or optimise(*given)
    )
    planned(CURVES, moving=np.array([[0.9, 1.0, -0.1, 0.05, 0.1]]))
    begin, gears, held, reference, terms, _ = calls[0]

    def slopes(states):
        """By differences of the cost, of what is not held."""
        found = []
        for i, p in zip(*np.nonzero(~held), strict=True):
            costs = []
            for step in (-1e-6, 1e-6):
                moved = states.copy()
                moved[i, p] += step
                costs.append(optimise(moved, gears, held, reference, terms, 0)[1])
            found.append((costs[1] - costs[0]) / 2e-6)
        return np.abs(found)

    end = begin
    for _ in range(20):
        end, _ = optimise(end, gears, held, reference, terms, 50)
    assert slopes(end).max() < 1e-2 * slopes(begin).max()
