"""A map made while driving: walls and trajectory near the true ones, loops closed, saved."""

import numpy as np
import pytest

from bench.autonomy_mapping import BAGS, Lap, drive, mapped, real
from scm.geometry import Pose2
from scm.maps.grid import load_occupancy
from scm.maps.load import load_map
from scm.maps.occupancy import map_from_occupancy
from scm.maps.segments import wall_segments
from vehicle_agent.autonomy import mapping
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED
from vehicle_agent.autonomy.mapping import save_map
from vehicle_agent.autonomy.pose_graph import Edge, optimized

NOISE_M = 0.025
LIMIT_M = 0.02  # of walls and of the trajectory


@pytest.fixture(scope="module")
def walls():
    return wall_segments(load_map("parking_school_obstacles"))


@pytest.fixture(scope="module")
def lap(walls):
    """One lap between people, without odometry."""
    return mapped(walls, drive(walls, Lap(), NOISE_M, 16.0, people=2))


def test_walls_and_trajectory_are_near_the_true_ones_without_odometry(lap):
    _, errors = lap
    assert errors.trajectory_m < LIMIT_M
    assert errors.wall_m < LIMIT_M


def test_loops_are_closed_and_odometry_may_drift(walls, monkeypatch):
    monkeypatch.setattr(mapping, "RECENT", 12)
    mapper, errors = mapped(walls, drive(walls, Lap(), NOISE_M, 20.0), drift=0.05)
    assert mapper.loops > 0
    assert errors.trajectory_m < LIMIT_M
    assert errors.wall_m < LIMIT_M


def test_what_was_driven_over_is_free_and_people_left_no_trace(lap):
    mapper, _ = lap
    grid = mapper.grid()
    places = np.array(mapper.trajectory)[:, :2]
    rows = ((places[:, 1] - grid.y_m) / grid.cell_m).astype(int)
    columns = ((places[:, 0] - grid.x_m) / grid.cell_m).astype(int)
    assert (grid.cells[rows, columns] == FREE).all()
    assert (grid.to_face_m[rows, columns] > 0.15).all()


def test_a_saved_map_is_read_back(lap, tmp_path):
    grid = lap[0].grid()
    save_map(grid, tmp_path / "room")
    read = load_occupancy(tmp_path / "room.yaml")
    np.testing.assert_array_equal(read.occupied, grid.cells == OCCUPIED)
    np.testing.assert_array_equal(read.free, grid.cells == FREE)
    assert read.cell_m == grid.cell_m
    assert read.origin == Pose2(grid.x_m, grid.y_m, 0.0)
    assert len(map_from_occupancy(tmp_path / "room.yaml").walls) > 0


def test_a_pose_graph_closes_a_square_and_ignores_a_false_loop():
    step, sure = Pose2(1.0, 0.0, np.pi / 2), np.diag((1e4, 1e4, 1e4))
    drifting = Pose2(1.02, 0.01, np.pi / 2 - 0.03)
    poses = [Pose2(0.0, 0.0, 0.0)]
    for _ in range(4):
        poses.append(poses[-1] @ drifting)
    edges = [Edge(k, k + 1, step, sure) for k in range(4)]
    edges.append(Edge(0, 4, Pose2(0.0, 0.0, 0.0), sure, is_loop=True))
    edges.append(Edge(0, 2, Pose2(3.0, 3.0, 0.0), sure, is_loop=True))
    found = optimized(poses, edges)
    np.testing.assert_allclose(found[4][:2], 0.0, atol=0.02)
    np.testing.assert_allclose(found[2][:2], 1.0, atol=0.02)


@pytest.mark.skipif(not BAGS.is_dir(), reason=f"{BAGS} is not part of this repository")
def test_real_walls_are_thin_and_real_sweeps_fit_better_than_with_the_bags_odometry():
    found = real(BAGS / "skidpad_lht_0_2.bag")
    assert found.thickness_m < 0.03
    assert found.ours.piece_m < 0.5 * found.theirs.piece_m
