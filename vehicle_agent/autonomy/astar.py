"""The shortest way over a coarse grid, as plain navigation stacks plan it: A*.

A baseline beside `hybrid_astar.py`. Cells of 0.05 m join their eight neighbours; within 0.15 m of
an obstacle a way costs more, and the rear axle comes no nearer than half of the car's width. The
car is a point: its line may bend more sharply than it can steer, and it never reverses.
Source: Hart, Nilsson and Raphael, "A Formal Basis for the Heuristic Determination of Minimum Cost
Paths", IEEE Transactions on Systems Science and Cybernetics 4(2), 1968.
"""

import heapq
import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import PathError
from scm.geometry import Pose2
from scm.vehicles.jit import array_kernel
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.outline import Scene, clearance_at, scene_of
from vehicle_agent.autonomy.plan import CarLimits, Path

CELL_M = 0.05
INFLATION_M = 0.15  # from obstacles, within which a way costs more
NEAR = 4.0  # of the length, on top, beside an obstacle; falls to 0 at `INFLATION_M`


@array_kernel
def _costs(scene: Scene, rows: int, columns: int, least_m: float) -> Floats:
    """Return what a metre costs in each cell, infinity where a car cannot be (rows, columns)."""
    costs = np.full((rows, columns), math.inf)
    for i in range(rows):
        for j in range(columns):
            x, y = scene.x_m + (j + 0.5) * CELL_M, scene.y_m + (i + 0.5) * CELL_M
            clearance = clearance_at(scene, x, y)
            if clearance >= least_m:
                costs[i, j] = 1.0 + NEAR * max(0.0, 1.0 - clearance / INFLATION_M)
    return costs


@array_kernel
def _search(costs: Floats, start: tuple[int, int], goal: tuple[int, int]) -> tuple[Ints, int]:
    """Return each cell's number of the cell before it, -1: none, and how many were looked at."""
    rows, columns = costs.shape
    before = np.full(rows * columns, -1)
    spent = np.full((rows, columns), math.inf)
    spent[start] = 0.0
    queue = [(0.0, 0.0, start[0], start[1])]
    looked = 0
    while len(queue) > 0:
        _, paid, i, j = heapq.heappop(queue)
        if paid > spent[i, j]:
            continue
        looked += 1
        if (i, j) == goal:
            break
        for k in range(9):
            row, column = i + k // 3 - 1, j + k % 3 - 1
            if row < 0 or column < 0 or row >= rows or column >= columns:
                continue
            cost = paid + CELL_M * math.hypot(row - i, column - j) * costs[row, column]
            if cost < spent[row, column]:
                spent[row, column] = cost
                before[row * columns + column] = i * columns + j
                remaining = CELL_M * math.hypot(goal[0] - row, goal[1] - column)
                heapq.heappush(queue, (cost + remaining, cost, row, column))
    return before, looked


def plan(grid: GridMap, limits: CarLimits, start: Pose2, goal: Pose2) -> Path:
    """Return a line from a start to a goal; its yaw follows it, and is the goal's at its end.

    Raises:
        PathError: when the goal's cell is not free, or no free cells lead to it.
    """
    rows, columns = (math.ceil(count * grid.cell_m / CELL_M) for count in grid.cells.shape)
    costs = _costs(scene_of(grid, limits), rows, columns, 0.5 * (limits.left_m - limits.right_m))
    first, last = (
        (math.floor((pose.y - grid.y_m) / CELL_M), math.floor((pose.x - grid.x_m) / CELL_M))
        for pose in (start, goal)
    )
    for name, pose, (row, column) in (("start", start, first), ("goal", goal, last)):
        if not (0 <= row < rows and 0 <= column < columns):
            raise PathError(f"{name} ({pose.x:.3f}, {pose.y:.3f}) m: outside the map")
    before, looked = _search(costs, first, last)
    here, cells = last[0] * columns + last[1], []
    if first != last and before[here] < 0:
        msg = f"goal ({goal.x:.3f}, {goal.y:.3f}) m: not reached over {looked} free cells"
        raise PathError(msg)
    while before[here] >= 0:
        here = int(before[here])
        cells.append(((here % columns + 0.5) * CELL_M, (here // columns + 0.5) * CELL_M))
    inner = np.array(cells[-2::-1]).reshape(-1, 2) + np.array((grid.x_m, grid.y_m))
    return _following(np.vstack((start[:2], inner, goal[:2])), goal.yaw)


def _following(points: Floats, last_yaw: float) -> Path:
    """Return the path along points (n, 2), driven forward."""
    steps = np.diff(points, axis=0)
    yaws = np.append(np.arctan2(steps[:, 1], steps[:, 0]), last_yaw)
    turns = np.remainder(np.diff(yaws) + math.pi, 2.0 * math.pi) - math.pi
    curvatures = turns / np.maximum(np.hypot(*steps.T), 1e-9)
    return Path(
        np.column_stack((points, yaws)), np.ones(len(points)), np.append(curvatures[0], curvatures)
    )
