from dataclasses import replace

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, grid_of_cells
from vehicle_agent.autonomy.navigation import Navigator
from vehicle_agent.autonomy.plan import CarLimits, Trajectory
from vehicle_agent.autonomy.trajectory_check import (
    STEP_M,
    is_free,
    is_within_limits,
    sampled,
)

LIMITS = CarLimits(
    wheelbase_m=0.1415, steering_rad=0.5236, steering_rate_radps=0.42,
    rear_m=-0.07, front_m=0.23, right_m=-0.0875, left_m=0.0875,
)  # fmt: skip
NOTHING = np.empty((0, 5))
TIMES = np.linspace(0.0, 5.0, 6)
STEADY = Trajectory(
    TIMES,
    np.column_stack((0.5 + 0.2 * TIMES, np.ones(6), np.zeros(6))),
    np.full(6, 0.2),
    np.zeros(6),
)


def floor(*boxes):
    cells = np.full((200, 300), FREE, np.int8)
    for left, low, right, high in boxes:
        cells[low:high, left:right] = OCCUPIED
    return grid_of_cells(cells, 0.01, 0.0, 0.0)


def test_steady_drive_is_free():
    assert is_free(floor(), LIMITS, STEADY, NOTHING)


@pytest.mark.parametrize(
    ("box", "free"),
    [
        ((120, 110, 122, 112), True),  # 1 cm beside the outline
        ((120, 107, 122, 112), False),
        ((175, 95, 180, 105), True),  # 2 cm before the end
        ((172, 95, 180, 105), False),
        ((100, 100, 101, 101), False),  # a pole that the outline passes over
    ],
)
def test_outline_decides_whether_a_box_is_touched(box, free):
    assert is_free(floor(box), LIMITS, STEADY, NOTHING) == free


def test_moving_obstacle_is_met_only_at_its_time():
    late = np.array([[1.0, 1.9, 0.0, -0.1, 0.1]])  # at y = 1 after 9 s
    on_time = np.array([[1.0, 1.3, 0.0, -0.1, 0.1]])  # after 3 s, when the car is at x = 1.1
    assert is_free(floor(), LIMITS, STEADY, late)
    assert not is_free(floor(), LIMITS, STEADY, on_time)


def test_leaving_the_map_is_not_free():
    assert not is_free(
        floor(), LIMITS, replace(STEADY, poses=STEADY.poses + np.array((1.5, 0.0, 0.0))), NOTHING
    )


@pytest.mark.parametrize(
    "change",
    [
        {"speeds_mps": np.full(6, 0.3)},
        {"speeds_mps": np.array([0.2, 0.0, 0.2, 0.2, 0.2, 0.2])},
        {"steering_rad": np.full(6, 0.6)},
        {"steering_rad": np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])},
        {"poses": STEADY.poses + np.outer(np.sin(TIMES), (0.0, 0.01, 0.0))},
        {"times_s": TIMES[::-1]},
        {"poses": np.full((6, 3), np.nan)},
    ],
)
def test_motion_that_is_not_this_cars_is_refused(change):
    assert is_within_limits(LIMITS, STEADY)
    assert not is_within_limits(LIMITS, replace(STEADY, **change))


def test_speed_above_the_limit_at_the_beginning_is_no_fault():
    speeds = np.array([0.25, 0.2, 0.2, 0.2, 0.2, 0.2])
    poses = STEADY.poses + np.outer(TIMES > 0, (0.025, 0.0, 0.0))
    assert is_within_limits(LIMITS, replace(STEADY, speeds_mps=speeds, poses=poses))


@pytest.mark.parametrize("turn", [0.0, 1.2, -1.2])
def test_poses_between_two_lie_on_an_arc_and_move_no_corner_far(turn):
    way, begin = 0.3, Pose2(0.5, 1.0, 3.0)
    chord = way if turn == 0.0 else 2.0 * way / turn * np.sin(0.5 * turn)
    end = begin @ Pose2(chord * np.cos(0.5 * turn), chord * np.sin(0.5 * turn), turn)
    poses, times = sampled(LIMITS, np.array((begin, end)), np.array((1.0, 2.5)))
    np.testing.assert_allclose(poses[[0, -1]], (begin, end), atol=1e-9)
    np.testing.assert_allclose(times, np.linspace(1.0, 2.5, len(times)))
    moved = [begin.inverse() @ Pose2(*map(float, pose)) for pose in poses]
    headings = np.unwrap([pose.yaw for pose in moved])
    np.testing.assert_allclose(headings, np.linspace(0.0, turn, len(times)), atol=1e-9)
    if turn:
        off = [np.hypot(pose.x, pose.y - way / turn) for pose in moved]
        np.testing.assert_allclose(off, abs(way / turn), atol=1e-9)
    corners = np.array([one.apply(LIMITS.front_m, LIMITS.right_m) for one in moved])
    assert np.hypot(*np.diff(corners, axis=0).T).max() <= STEP_M + 1e-9


def test_way_is_blocked_by_a_pole_that_only_the_outline_between_two_poses_touches():
    poses = np.array(((0.5, 1.0, 0.0), (0.9, 1.0, 0.0)))
    way = Trajectory(np.array((0.0, 1.4)), poses, np.full(2, 0.2), np.zeros(2))
    navigator = Navigator(load_car("nigel"))
    navigator._tracker.follow(way)
    assert navigator.is_blocked(floor((77, 99, 79, 101)))
    assert not navigator.is_blocked(floor((77, 115, 79, 117)))
