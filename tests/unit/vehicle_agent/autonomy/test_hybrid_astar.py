import math

import numpy as np
import pytest

from scm.errors import PathError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.vehicles.car import load_car
from vehicle_agent.autonomy.grid_map import grid_of_city, with_points
from vehicle_agent.autonomy.hybrid_astar import plan
from vehicle_agent.autonomy.outline import outline_clearance, room, scene_of
from vehicle_agent.autonomy.plan import limits_of

CITY = load_map("parking_school_obstacles")
GRID = grid_of_city(CITY)
CAR = limits_of(load_car("nigel"))
SPAWNS = {spawn.name: Pose2(*map(float, spawn.pose)) for spawn in CITY.spawns}
START, GOAL = SPAWNS["start"], SPAWNS["goal"]
MARGIN = 0.02


def ring(middle, radius, count):
    angles = np.linspace(0.0, 2.0 * math.pi, count)
    return np.column_stack((
        middle.x + 0.08 + radius * np.cos(angles), middle.y + radius * np.sin(angles)
    ))  # fmt: skip


def assert_drivable(path, start, goal):
    assert tuple(path.poses[0]) == start
    np.testing.assert_allclose(Pose2(*path.poses[-1]).inverse() @ goal, np.zeros(3), atol=1e-9)
    assert np.abs(path.curvatures).max() <= 1.0 / CAR.radius_m + 1e-9
    for before, after, gear, curvature in zip(
        path.poses, path.poses[1:], path.gears[1:], path.curvatures[1:], strict=False
    ):
        step = Pose2(*before).inverse() @ Pose2(*after)
        assert step.x * gear > 0.0
        assert math.hypot(step.x, step.y) < 0.05
        assert step.yaw == pytest.approx(curvature * gear * math.hypot(step.x, step.y), abs=1e-3)


@pytest.mark.parametrize("name", ["start", "a", "b", "c"])
def test_path_from_each_spawn_is_drivable_and_free(name):
    path = plan(GRID, CAR, SPAWNS[name], GOAL, margin_m=MARGIN)
    assert_drivable(path, SPAWNS[name], GOAL)
    assert np.isfinite(room(scene_of(GRID, CAR), path.poses, MARGIN)).all()


def test_same_problem_gives_same_path():
    first, second = (plan(GRID, CAR, START, GOAL) for _ in range(2))
    np.testing.assert_array_equal(first.poses, second.poses)


def test_goal_straight_ahead_needs_one_line():
    path = plan(GRID, CAR, SPAWNS["a"], GOAL)
    assert path.cusps == 0
    assert path.length_m == pytest.approx(GOAL.x - SPAWNS["a"].x)


def test_car_parks_backward_where_it_must_turn():
    path = plan(GRID, CAR, GOAL, Pose2(0.5, 0.0, math.pi))
    assert_drivable(path, GOAL, Pose2(0.5, 0.0, math.pi))
    assert path.gears[0] == -1


def test_points_that_the_map_does_not_show_are_avoided():
    points = np.array([[0.0, y] for y in np.arange(-0.1, 0.6, 0.02)])
    path = plan(GRID, CAR, SPAWNS["a"], GOAL, blocked=points, margin_m=MARGIN)
    assert_drivable(path, SPAWNS["a"], GOAL)
    scene = scene_of(with_points(GRID, points), CAR)
    assert np.isfinite(room(scene, path.poses, MARGIN)).all()


def test_car_that_stands_too_near_a_wall_leaves_it():
    start = Pose2(-0.6, 0.525, 0.0)
    clearance = outline_clearance(scene_of(GRID, CAR), start)
    assert 0.0 < clearance < MARGIN
    path = plan(GRID, CAR, start, GOAL, margin_m=MARGIN)
    assert_drivable(path, start, GOAL)
    least = min(outline_clearance(scene_of(GRID, CAR), Pose2(*pose)) for pose in path.poses)
    assert least > clearance - 0.005


@pytest.mark.parametrize(
    ("start", "goal", "words"),
    [
        (START, Pose2(0.86, 0.31, 0.0), "goal .*deep in an obstacle"),
        (START, Pose2(0.75, 0.105, 0.0), "goal .* m to an obstacle, expected 0.02 m or more"),
        (START, Pose2(5.0, 0.0, 0.0), "goal .*outside the map"),
        (Pose2(0.86, 0.31, 0.0), GOAL, "start .*deep in an obstacle"),
    ],
)  # fmt: skip
def test_pose_that_is_not_free_is_refused(start, goal, words):
    with pytest.raises(PathError, match=words):
        plan(GRID, CAR, start, goal)


def test_goal_behind_obstacles_is_not_reached():
    closed = ring(GOAL, 0.27, 60)
    with pytest.raises(PathError, match=r"no path found among .* nodes, all that can be reached"):
        plan(GRID, CAR, START, GOAL, blocked=closed)


def test_search_ends_at_its_limit():
    wall = np.array([[0.0, y] for y in np.arange(-0.1, 0.6, 0.02)])
    with pytest.raises(PathError, match="the limit of the search"):
        plan(GRID, CAR, SPAWNS["a"], GOAL, blocked=wall, max_nodes=50)
