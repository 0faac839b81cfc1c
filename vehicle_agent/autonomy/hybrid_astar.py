"""A path that a car can drive, forward and backward, between two poses on a grid: Hybrid A*.

Nodes are poses; a node stands for all poses in its cell of x, y, yaw and gear, and keeps its exact
pose, so the path is drivable as found. From a node the car drives `STEP` radii at one of five
steering angles, forward or backward. The cost of a path is the length that could be driven in the
same time, and some for safety, see `Costs`. What remains is estimated by the greater of two costs:
that of the cheapest Reeds-Shepp word without obstacles, and of a point's way round obstacles.
From some nodes, more often near the goal, the Reeds-Shepp words to the goal are tried; the cheapest
free one ends the search when no node promises a path cheaper by more than `SLACK`.

Equal arguments give equal paths: nothing depends on time or chance.
Source: Dolgov, Thrun, Montemerlo and Diebel, "Path planning for autonomous vehicles in unknown
semi-structured environments", International Journal of Robotics Research 29(5), 2010. The costs and
the rule that ends the search are ours.
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from scm.arrays import Floats, Ints
from scm.errors import PathError
from scm.geometry import TAU, Pose2
from scm.vehicles.jit import array_kernel, inlined, kernel_function
from vehicle_agent.autonomy.grid_map import GridMap, with_points
from vehicle_agent.autonomy.outline import (
    Scene,
    clearance_at,
    outline_clearance,
    room_at,
    scene_of,
)
from vehicle_agent.autonomy.plan import CarLimits, Path
from vehicle_agent.autonomy.reeds_shepp import LONGEST_WORD, WORDS, least_cost, sampled, word

STEP = 0.2  # of the turning radius: a motion, which leaves a cell by every way
CELL = 0.125  # of the turning radius
YAWS = 64
FINER = (1, 2, 4)  # search again with motions and cells so much smaller, where no motion is free
STEERING = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # of full curvature
SAMPLE_M = 0.025  # from one pose that is checked to the next, at most
MAX_NODES = 150_000  # about 1 s
SLACK = 0.2  # of a path's cost, that a longer search could save
REVERSE = 0.3  # of the length, on top: the scanner and the camera look ahead
NEAR = 1.0  # of the length, on top, where there is no room beside the car
NEAR_M = 0.08  # room from which on nothing is added
STEERING_SHARE = 0.5  # of the time for steering that the car does not drive meanwhile
OCTILE = math.cos(math.pi / 8)  # least ratio of a straight line to the way over cells
LEAVE_M = 0.15  # from the start, within which its own clearance is enough
LEAVE_SLACK_M = 0.003  # by which a car that leaves may come nearer
DEEPEST_START_M = 0.02  # that a pose which is wrong by a little may lie in an obstacle
_FOUND, _EXHAUSTED, _LIMIT = 0, 1, 2


class Costs(NamedTuple):
    """What is added to the length of a path [m].

    Attributes:
        cusp_m: For each change of gear: the way lost by braking and speeding up.
        steering_m_per_rad: For each change of the steering angle.
    """

    cusp_m: float
    steering_m_per_rad: float


class _Task(NamedTuple):
    """Of one search: goal, car and costs; `margin_m` to keep, `start_margin_m` near the start."""

    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    radius_m: float
    wheelbase_m: float
    margin_m: float
    start_margin_m: float
    costs: Costs
    cells: tuple[int, int, float]  # rows and columns of the search's grid, and a cell's edge [m]
    yaws: int
    step_m: float


class _Nodes(NamedTuple):
    """Nodes as columns of arrays (limit, ...), and which one holds a cell.

    Attributes:
        poses: (limit, 3); `costs`: from the start.
        motions: (limit, 2) signed length [m] and curvature [1/m] by which a node was reached.
        parents, keys: Number of the node before, and of the cell.
        table: Hash table of node numbers by key, -1: empty; its size is a power of 2.
    """

    poses: Floats
    costs: Floats
    motions: Floats
    parents: Ints
    keys: Ints
    table: Ints


def costs_of(limits: CarLimits) -> Costs:
    """Return the costs that time sets: what a car could drive at its speed in the time lost."""
    speed = limits.speed_mps
    return Costs(
        cusp_m=speed * speed / limits.accel_mps2,
        steering_m_per_rad=STEERING_SHARE * speed / limits.steering_rate_radps,
    )


@inlined
def _moved(
    x: float, y: float, yaw: float, size: float, curvature: float
) -> tuple[float, float, float]:
    """Return the pose after a signed length at a curvature."""
    half = 0.5 * size * curvature
    chord = size * (math.sin(half) / half if half != 0.0 else 1.0)
    return x + chord * math.cos(yaw + half), y + chord * math.sin(yaw + half), yaw + 2.0 * half


@kernel_function
def _drive_cost(
    scene: Scene, task: _Task, pose: tuple[float, float, float], size: float, curvature: float
) -> float:
    """Return the cost of driving a signed length at a curvature, infinity where it is not free."""
    steps = max(1, math.ceil(abs(size) / SAMPLE_M - 1e-9))
    total = 0.0
    for k in range(1, steps + 1):
        x, y, yaw = _moved(pose[0], pose[1], pose[2], size * k / steps, curvature)
        leaves = math.hypot(x - task.start[0], y - task.start[1]) < LEAVE_M
        room = room_at(scene, x, y, yaw, task.start_margin_m if leaves else task.margin_m)
        if room == -math.inf:
            return math.inf
        close = max(0.0, 1.0 - room / NEAR_M)
        total += 1.0 + NEAR * close * close
    return total * abs(size) / steps * (1.0 if size > 0.0 else 1.0 + REVERSE)


@inlined
def _change_cost(
    task: _Task, last_size: float, last_curvature: float, size: float, curvature: float
) -> float:
    """Return the cost of going over from a motion to the next one; its size 0: from rest."""
    if last_size == 0.0:
        return 0.0
    turn = math.atan(curvature * task.wheelbase_m) - math.atan(last_curvature * task.wheelbase_m)
    cusp = task.costs.cusp_m if last_size * size < 0.0 else 0.0
    return cusp + task.costs.steering_m_per_rad * abs(turn)


@inlined
def _cell(scene: Scene, task: _Task, x: float, y: float) -> tuple[int, int]:
    """Return row and column of the search's grid, -1 and -1 outside."""
    rows, columns, cell_m = task.cells
    row, column = math.floor((y - scene.y_m) / cell_m), math.floor((x - scene.x_m) / cell_m)
    inside = 0 <= row < rows and 0 <= column < columns
    return (row, column) if inside else (-1, -1)


@kernel_function
def _entry_of(nodes: _Nodes, key: int) -> int:
    """Return where the table holds a key's node, or where it would."""
    mask = len(nodes.table) - 1
    at = (key * 0x9E3779B1 >> 7) & mask
    while nodes.table[at] >= 0 and nodes.keys[nodes.table[at]] != key:
        at = (at + 1) & mask
    return at


@array_kernel
def _ways_to_goal(scene: Scene, task: _Task, least_m: float) -> Floats:
    """Return each cell's shortest way to the goal for a point with a clearance, (rows, columns)."""
    rows, columns, cell_m = task.cells
    way = np.full((rows, columns), math.inf)
    row, column = _cell(scene, task, task.goal[0], task.goal[1])
    way[row, column] = 0.0
    queue = [(0.0, row, column)]
    while len(queue) > 0:
        far, i, j = heapq.heappop(queue)
        if far > way[i, j]:
            continue
        for k in range(9):
            row, column = i + k // 3 - 1, j + k % 3 - 1
            if row < 0 or column < 0 or row >= rows or column >= columns:
                continue
            x, y = scene.x_m + (column + 0.5) * cell_m, scene.y_m + (row + 0.5) * cell_m
            to = far + cell_m * math.hypot(row - i, column - j)
            if to < way[row, column] and not clearance_at(scene, x, y) < least_m:
                way[row, column] = to
                heapq.heappush(queue, (to, row, column))
    return way


@kernel_function
def _remaining(scene: Scene, task: _Task, ways: Floats, x: float, y: float, yaw: float) -> float:
    """Return a lower estimate of the way to the goal, infinity where there is none."""
    row, column = _cell(scene, task, x, y)
    if row < 0 or ways[row, column] == math.inf:
        return math.inf
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = task.goal[0] - x, task.goal[1] - y
    ahead, left, turn = c * dx + s * dy, c * dy - s * dx, task.goal[2] - yaw
    free = least_cost(ahead, left, turn, task.radius_m, REVERSE, task.costs.cusp_m)
    return max(free, OCTILE * float(ways[row, column] - task.cells[2]))


@kernel_function
def _word_cost(
    scene: Scene,
    task: _Task,
    nodes: _Nodes,
    node: int,
    sizes: Floats,
    sides: Floats,
    count: int,
    limit: float,
) -> float:
    """Return the cost of a path over a node and a word, infinity where not free or over a limit."""
    cost = float(nodes.costs[node])
    last_size, last_curvature = nodes.motions[node]
    for k in range(count):
        size, curvature = sizes[k] * task.radius_m, sides[k] / task.radius_m
        cost += abs(size) + _change_cost(task, last_size, last_curvature, size, curvature)
        last_size, last_curvature = size, curvature
    if cost >= limit:
        return math.inf
    x, y, yaw = nodes.poses[node]
    for k in range(count):
        size, curvature = sizes[k] * task.radius_m, sides[k] / task.radius_m
        cost += _drive_cost(scene, task, (x, y, yaw), size, curvature) - abs(size)
        if cost >= limit:
            return math.inf
        x, y, yaw = _moved(x, y, yaw, size, curvature)
    return cost


@kernel_function
def _try_words(
    scene: Scene, task: _Task, nodes: _Nodes, node: int, limit: float, tail: Floats
) -> tuple[float, int]:
    """Return cost and count of segments of the cheapest free word to the goal below a limit.

    Signed lengths and curvatures of the segments are written into two columns of the tail (5, 4).
    """
    x, y, yaw = nodes.poses[node]
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = (task.goal[0] - x) / task.radius_m, (task.goal[1] - y) / task.radius_m
    found = 0
    sizes, sides = tail[:, 2], tail[:, 3]  # of the word being tried
    for number in range(WORDS):
        count = word(number, c * dx + s * dy, c * dy - s * dx, task.goal[2] - yaw, sizes, sides)
        if count == 0:
            continue
        cost = _word_cost(scene, task, nodes, node, sizes, sides, count, limit)
        if cost < limit:
            limit, found = cost, count
            for k in range(count):
                tail[k, 0], tail[k, 1] = sizes[k] * task.radius_m, sides[k] / task.radius_m
    return limit, found


@kernel_function
def _add(
    scene: Scene, task: _Task, nodes: _Nodes, count: int, node: int, size: float, curvature: float
) -> bool:
    """Return whether a motion from a node leads to a new or cheaper one; write it at `count`."""
    px, py, pyaw = nodes.poses[node]
    x, y, yaw = _moved(px, py, pyaw, size, curvature)
    row, column = _cell(scene, task, x, y)
    if row < 0:
        return False
    heading = math.floor(yaw / TAU * task.yaws) % task.yaws
    key = ((row * task.cells[1] + column) * task.yaws + heading) * 2 + (1 if size < 0.0 else 0)
    entry = _entry_of(nodes, key)
    known = nodes.costs[nodes.table[entry]] if nodes.table[entry] >= 0 else math.inf
    last_size, last_curvature = nodes.motions[node]
    cost = nodes.costs[node] + _change_cost(task, last_size, last_curvature, size, curvature)
    if cost + abs(size) >= known:
        return False
    cost += _drive_cost(scene, task, (px, py, pyaw), size, curvature)
    if cost >= known:
        return False
    nodes.poses[count, 0], nodes.poses[count, 1], nodes.poses[count, 2] = x, y, yaw
    nodes.motions[count, 0], nodes.motions[count, 1] = size, curvature
    nodes.costs[count], nodes.parents[count], nodes.keys[count] = cost, node, key
    nodes.table[entry] = count
    return True


@array_kernel
def _search(
    scene: Scene, task: _Task, ways: Floats, nodes: _Nodes, tail: Floats
) -> tuple[int, int, int, int]:
    """Return how the search ended, nodes looked at, last node of the path, segments after it."""
    limit = len(nodes.costs) - 2 * len(STEERING)
    nodes.poses[0, 0], nodes.poses[0, 1], nodes.poses[0, 2] = task.start
    first = _remaining(scene, task, ways, task.start[0], task.start[1], task.start[2])
    queue = [(first, 0)]
    best, last, segments = math.inf, -1, 0
    count, looked, untried = 1, 0, 1_000_000
    while len(queue) > 0 and count < limit:
        estimate, node = heapq.heappop(queue)
        if estimate * (1.0 + SLACK) >= best or estimate == math.inf:
            break
        if node > 0 and nodes.table[_entry_of(nodes, nodes.keys[node])] != node:
            continue  # a cheaper way to its cell was found since
        looked += 1
        untried += 1
        if untried * task.radius_m > estimate - nodes.costs[node]:
            cost, found = _try_words(scene, task, nodes, node, best, tail)
            if found > 0:
                best, last, segments = cost, node, found
            untried = 0
        for k in range(2 * len(STEERING)):
            size = task.step_m * (1.0 if k < len(STEERING) else -1.0)
            curvature = STEERING[k % len(STEERING)] / task.radius_m
            if _add(scene, task, nodes, count, node, size, curvature):
                x, y, yaw = nodes.poses[count]
                estimate = nodes.costs[count] + _remaining(scene, task, ways, x, y, yaw)
                if estimate < best:
                    heapq.heappush(queue, (estimate, count))
                count += 1
    if last >= 0:
        return _FOUND, looked, last, segments
    return (_EXHAUSTED if count < limit else _LIMIT), looked, last, segments


def plan(
    grid: GridMap,
    limits: CarLimits,
    start: Pose2,
    goal: Pose2,
    *,
    margin_m: float = 0.02,
    blocked: Floats | None = None,
    max_nodes: int = MAX_NODES,
) -> Path:
    """Return a path from a start to a goal, poses of the rear axle in the map's frame.

    Args:
        grid: Where the car may be.
        limits: Of the car.
        start: Where the car stands.
        goal: Where it is to stand.
        margin_m: Between the outline and obstacles; a start that is nearer may be left.
        blocked: Points (k, 2) of obstacles that the grid does not show [m].
        max_nodes: To give up after.

    Raises:
        PathError: when start or goal are not free, or no path was found.
    """
    if blocked is not None and len(blocked) > 0:
        grid = with_points(grid, blocked)
    scene = scene_of(grid, limits)
    start, goal = Pose2(*map(float, start)), Pose2(*map(float, goal))  # ints compile it all anew
    clearance = _checked(scene, "start", start, -DEEPEST_START_M)
    _checked(scene, "goal", goal, margin_m)
    nodes, tail = _empty(max_nodes), np.zeros((LONGEST_WORD, 4))
    for finer in FINER:
        nodes.table[:] = -1
        task = _task(grid, limits, start, goal, margin_m, clearance, finer)
        inside = min(-limits.rear_m, limits.left_m, -limits.right_m) - task.cells[2]
        ways = _ways_to_goal(scene, task, inside + task.start_margin_m)
        ended, looked, last, segments = _search(scene, task, ways, nodes, tail)
        if ended != _EXHAUSTED:
            break
    if ended != _FOUND:
        why = f"no path found among {looked} nodes, " + (
            "all that can be reached" if ended == _EXHAUSTED else "the limit of the search"
        )
        raise PathError(f"goal {_words(goal)} from start {_words(start)}: {why}")
    chain = []
    while last > 0:
        chain.append(nodes.motions[last])
        last = int(nodes.parents[last])
    return sampled(start, np.array([*chain[::-1], *tail[:segments, :2]]), SAMPLE_M)


def _task(
    grid: GridMap, limits: CarLimits, start: Pose2, goal: Pose2, margin_m: float, clearance: float,
    finer: int,
) -> _Task:  # fmt: skip
    """Return a search with cells and motions that much smaller; `clearance`: of the start [m]."""
    cell_m = CELL * limits.radius_m / finer
    rows, columns = (math.ceil(count * grid.cell_m / cell_m) for count in grid.cells.shape)
    return _Task(
        (start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw), limits.radius_m,
        limits.wheelbase_m, margin_m, min(margin_m, clearance - LEAVE_SLACK_M), costs_of(limits),
        (rows, columns, cell_m), YAWS * finer, STEP * limits.radius_m / finer,
    )  # fmt: skip


def _empty(limit: int) -> _Nodes:
    size = 2 ** math.ceil(math.log2(2 * limit))
    return _Nodes(
        np.empty((limit, 3)), np.zeros(limit), np.zeros((limit, 2)), np.empty(limit, np.int64),
        np.full(limit, -1), np.full(size, -1),
    )  # fmt: skip


def _words(pose: Pose2) -> str:
    return f"({pose.x:.3f} m, {pose.y:.3f} m, {pose.yaw:.2f} rad)"


def _checked(scene: Scene, name: str, pose: Pose2, margin_m: float) -> float:
    """Return the clearance of a pose's outline.

    Raises:
        PathError: when it is less than a margin.
    """
    clearance = outline_clearance(scene, pose)
    if clearance >= margin_m:
        return clearance
    rows, columns = scene.clearance.shape
    low_x, low_y = scene.x_m, scene.y_m
    high_x, high_y = low_x + columns * scene.cell_m, low_y + rows * scene.cell_m
    where = f"{name} {_words(pose)}"
    if not (low_x <= pose.x <= high_x and low_y <= pose.y <= high_y):
        msg = (
            f"{where}: outside the map, which goes from ({low_x:.2f}, {low_y:.2f}) m to "
            f"({high_x:.2f}, {high_y:.2f}) m"
        )
    elif clearance < 0.0:
        msg = f"{where}: the car's outline lies {-clearance:.3f} m deep in an obstacle"
    else:
        msg = f"{where}: {clearance:.3f} m to an obstacle, expected {margin_m:g} m or more"
    raise PathError(msg)
