from types import SimpleNamespace

import numpy as np
import pytest

from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, grid_of_cells
from vehicle_agent.autonomy.shown import COSTMAP_CELLS, costmap_of, shown

LIMITS = SimpleNamespace(right_m=-0.0875, left_m=0.09)


def costmap(cells, cell_m):
    grid = grid_of_cells(cells, cell_m, -1.0, 2.0)
    perception = SimpleNamespace(obstacles=SimpleNamespace(grid=grid))
    parking = SimpleNamespace(perception=perception, navigator=SimpleNamespace(limits=LIMITS))
    sent = costmap_of(parking, "n1", 7)
    return sent, np.frombuffer(sent.cells, np.uint8).reshape(sent.rows, sent.columns)


def test_costmap_has_the_least_clearance_of_each_cell_in_steps():
    cells = np.full((101, 300), FREE, np.int8)
    cells[:, 0] = OCCUPIED
    sent, steps = costmap(cells, 0.01)
    assert (sent.rows, sent.columns, sent.cell_m) == (51, 150, 0.02)
    assert (sent.x_m, sent.y_m, sent.half_width_m) == (-1.0, 2.0, 0.0875)
    # Cell 40 is 0.80 to 0.82 m from the corner, its nearest fine middle at 0.805; the wall ends
    # at 0.01. What is farther than 2.55 m counts as 2.55.
    assert (steps[20, [0, 40, 149]] == (0, 79, 255)).all()


def test_costmap_of_a_large_place_has_coarser_cells():
    sent, _ = costmap(np.full((1000, 2000), FREE, np.int8), 0.01)
    assert sent.rows * sent.columns <= COSTMAP_CELLS
    assert sent.cell_m == pytest.approx(0.03)


def test_poses_are_thinned_out_and_the_last_stays():
    poses = np.arange(900.0).reshape(300, 3)
    assert len(shown(poses, 30)) == 30
    assert shown(poses, 30)[-1] == tuple(poses[-1])
    assert shown(None) == ()
