import numpy as np
import pytest

from scm.geometry import Pose2
from vehicle_agent.autonomy.grid_map import OCCUPIED, grid_of_cells, with_points
from vehicle_agent.autonomy.outline import outline_clearance, room, scene_of
from vehicle_agent.autonomy.plan import CarLimits

CAR = CarLimits(
    wheelbase_m=0.1415, steering_rad=0.5236, steering_rate_radps=0.42, rear_m=-0.07, front_m=0.23,
    right_m=-0.0875, left_m=0.0875,
)  # fmt: skip
EMPTY = grid_of_cells(np.zeros((200, 200), np.int8), 0.01, -1.0, -1.0)
FINE = 0.004  # what halving leaves open, and a cell's rounding of a distance


def test_clearance_is_the_distance_from_outline_to_points():
    rng = np.random.default_rng(2)
    for _ in range(50):
        points = rng.uniform(-0.8, 0.8, (6, 2))
        pose = Pose2(*rng.uniform(-0.5, 0.5, 2), rng.uniform(-3.0, 3.0))
        seen = np.array([pose.inverse().apply(*point) for point in points])
        ahead = np.maximum(CAR.rear_m - seen[:, 0], seen[:, 0] - CAR.front_m)
        aside = np.abs(seen[:, 1]) - CAR.left_m
        distance = np.hypot(np.maximum(ahead, 0.0), np.maximum(aside, 0.0)).min()
        found = outline_clearance(scene_of(with_points(EMPTY, points), CAR), pose)
        if distance > 0.0:
            assert found == pytest.approx(distance, abs=2 * FINE)
        else:
            assert found < FINE


def test_point_inside_outline_is_not_free():
    poses = np.zeros((1, 3))
    for x in (-0.06, 0.08, 0.22):
        scene = scene_of(with_points(EMPTY, np.array([[x, 0.05]])), CAR)
        assert room(scene, poses, EMPTY.cell_m)[0] == -np.inf


def test_gap_counts_as_outline_needs_it():
    cells = np.full((200, 200), OCCUPIED, np.int8)
    cells[90:111] = 0  # 0.21 m high, about y = 0.005 m: the circles alone need 0.19 m + margins
    scene = scene_of(grid_of_cells(cells, 0.01, -1.0, -1.0), CAR)
    poses = np.array([[0.0, 0.005, 0.0]])
    assert np.isfinite(room(scene, poses, 0.013))[0]
    assert not np.isfinite(room(scene, poses, 0.02))[0]


def test_pose_outside_grid_is_not_free():
    assert room(scene_of(EMPTY, CAR), np.array([[1.2, 0.0, 0.0]]), 0.0)[0] == -np.inf
