import math

import numpy as np
import pytest

from scm.errors import PathError
from scm.geometry import Pose2
from vehicle_agent.autonomy.astar import CELL_M, plan
from vehicle_agent.autonomy.grid_map import OCCUPIED, grid_of_cells
from vehicle_agent.autonomy.plan import CarLimits

CAR = CarLimits(
    wheelbase_m=0.1415, steering_rad=0.5236, steering_rate_radps=0.42, rear_m=-0.07, front_m=0.23,
    right_m=-0.0875, left_m=0.0875,
)  # fmt: skip
START, GOAL = Pose2(0.225, 0.525, 0.0), Pose2(1.775, 0.525, 0.4)


def grid(gap_m=None):
    """A floor of 2 m by 1 m; a wall across it at x = 1 m, with a gap above."""
    cells = np.zeros((100, 200), np.int8)
    if gap_m is not None:
        cells[: 100 - round(100 * gap_m), 98:102] = OCCUPIED
    return grid_of_cells(cells, 0.01, 0.0, 0.0)


def test_path_on_free_floor_is_a_line_and_ends_as_the_goal():
    path = plan(grid(), CAR, START, GOAL)
    assert tuple(path.poses[-1]) == GOAL
    assert path.length_m == pytest.approx(1.55)
    np.testing.assert_allclose(path.poses[:-1, 2], 0.0, atol=1e-9)
    assert (path.gears == 1.0).all()


def test_path_goes_through_a_gap_with_half_of_the_width_to_spare():
    path = plan(grid(gap_m=0.4), CAR, START, GOAL)
    beside = path.poses[np.abs(path.poses[:, 0] - 1.0) < 0.5 * CELL_M]
    assert len(beside)
    assert (beside[:, 1] >= 0.6 + CAR.left_m).all()
    steps = np.hypot(*np.diff(path.poses[:, :2], axis=0).T)
    assert steps.max() <= math.sqrt(2.0) * CELL_M + 1e-9


def test_goal_behind_a_wall_is_not_reached():
    with pytest.raises(PathError, match=r"not reached over .* free cells"):
        plan(grid(gap_m=0.0), CAR, START, GOAL)


def test_goal_outside_the_map_is_refused():
    with pytest.raises(PathError, match=r"goal .*outside the map"):
        plan(grid(), CAR, START, Pose2(3.0, 0.5, 0.0))
