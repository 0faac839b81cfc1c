"""Paths for parking: time, success and length of Hybrid A*, beside OMPL's planners in the same run.

Run with `python -m bench autonomy_plan`; without ompl (`pip install -e '.[bench]'`) it prints ours
alone. Random free starts and goals on both parking maps. OMPL plans in its Reeds-Shepp space, with
our collision check as a Python function, and simplifies nothing: RRT* minimises length for all the
time it has, RRT-Connect ends at its first path. "checks" is the share of its time that the check
takes: a planner in C++ throughout would have the rest.
"""

import argparse
import itertools
import math
import time
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from scm.arrays import Floats
from scm.errors import PathError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.vehicles.car import load_car
from vehicle_agent.autonomy import hybrid_astar
from vehicle_agent.autonomy.grid_map import GridMap, grid_of_city
from vehicle_agent.autonomy.outline import Scene, outline_clearance, room, scene_of
from vehicle_agent.autonomy.plan import CarLimits, limits_of

MAPS = ("parking_school", "parking_school_obstacles")
MARGIN_M = 0.02
PEER_TIMES_S = (0.05, 1.0)  # what ours is to keep, and twenty times that
CHECK_STEP_M = hybrid_astar.SAMPLE_M


@dataclass(slots=True)
class Result:
    """What a planner found, a number a problem; `lengths` has NaN where it found nothing."""

    seconds: list[float] = field(default_factory=list)
    lengths: list[float] = field(default_factory=list)
    cusps: list[float] = field(default_factory=list)
    checks_s: float = 0.0

    def add(self, seconds: float, length: float = math.nan, cusps: float = math.nan) -> None:
        self.seconds.append(seconds)
        self.lengths.append(length)
        self.cusps.append(cusps)


def problems(grid: GridMap, scene: Scene, count: int, seed: int = 0) -> list[tuple[Pose2, Pose2]]:
    """Return pairs of free poses, drawn evenly."""
    rng = np.random.default_rng(seed)
    rows, columns = grid.cells.shape
    free: list[Pose2] = []
    while len(free) < 2 * count:
        pose = Pose2(
            grid.x_m + rng.uniform(0.0, columns * grid.cell_m),
            grid.y_m + rng.uniform(0.0, rows * grid.cell_m),
            rng.uniform(-math.pi, math.pi),
        )
        if outline_clearance(scene, pose) >= MARGIN_M:
            free.append(pose)
    return list(zip(free[::2], free[1::2], strict=True))


def ours(grid: GridMap, limits: CarLimits, pairs: list[tuple[Pose2, Pose2]]) -> Result:
    """Return what Hybrid A* finds."""
    result = Result()
    hybrid_astar.plan(grid, limits, *pairs[0], margin_m=MARGIN_M)  # compiles
    for start, goal in pairs:
        begin = time.process_time()
        try:
            path = hybrid_astar.plan(grid, limits, start, goal, margin_m=MARGIN_M)
        except PathError:
            result.add(time.process_time() - begin)
        else:
            result.add(time.process_time() - begin, path.length_m, path.cusps)
    return result


def peers(
    name: str, scene: Scene, limits: CarLimits, pairs: list[tuple[Pose2, Pose2]], seconds: float
) -> Result:
    """Return what one of OMPL's planners finds in a time."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_ERROR)
    room(scene, np.array([pairs[0][0]]), MARGIN_M)  # compiles
    result, pose = Result(), np.empty((1, 3))

    def is_free(state: "base.State") -> bool:
        begin = time.process_time()
        pose[0] = state.getX(), state.getY(), state.getYaw()
        free = bool(np.isfinite(room(scene, pose, MARGIN_M))[0])
        result.checks_s += time.process_time() - begin
        return free

    for start, goal in pairs:
        space = base.ReedsSheppStateSpace(limits.radius_m)
        bounds = base.RealVectorBounds(2)
        rows, columns = scene.clearance.shape
        for axis, low, cells in ((0, scene.x_m, columns), (1, scene.y_m, rows)):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, low + cells * scene.cell_m)
        space.setBounds(bounds)
        setup = geometric.SimpleSetup(space)
        setup.setStateValidityChecker(is_free)
        information = setup.getSpaceInformation()
        information.setStateValidityCheckingResolution(CHECK_STEP_M / space.getMaximumExtent())
        ends = [space.allocState(), space.allocState()]
        for state, (x, y, yaw) in zip(ends, (start, goal), strict=True):
            state.setX(x)
            state.setY(y)
            state.setYaw(yaw)
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(getattr(geometric, name)(information))
        begin = time.process_time()
        over = base.PlannerTerminationCondition(
            lambda begin=begin: time.process_time() - begin > seconds
        )
        setup.solve(over)
        spent = time.process_time() - begin
        if setup.haveExactSolutionPath():
            path = setup.getSolutionPath()
            length = path.length()
            path.interpolate(max(2, math.ceil(length / CHECK_STEP_M)))
            result.add(spent, length, cusps_along(path.getStates()))
        else:
            result.add(spent)
    return result


def cusps_along(states: list) -> int:
    """Return how often a path of states changes direction."""
    poses = [Pose2(state.getX(), state.getY(), state.getYaw()) for state in states]
    ahead = np.array([(a.inverse() @ b).x for a, b in itertools.pairwise(poses)])
    return int(np.count_nonzero(np.diff(np.sign(ahead[np.abs(ahead) > 1e-6]))))


def show(name: str, result: Result, reference: Floats) -> None:
    """Print a row; `reference`: our lengths of the same problems."""
    lengths = np.array(result.lengths)
    found = np.isfinite(lengths)
    both = found & np.isfinite(reference)
    ratio = lengths[both].sum() / reference[both].sum() if both.any() else math.nan
    ms = 1000.0 * np.array(result.seconds)
    cusps = np.nanmean(result.cusps) if found.any() else math.nan
    print(f"{name:22s} {len(ms):8d} {100 * found.mean():6.1f} % {np.median(ms):8.1f}"
          f" {np.percentile(ms, 99):8.1f} {ratio:8.2f} {cusps:7.2f}"
          f" {100 * result.checks_s * 1000.0 / ms.sum():8.0f} %", flush=True)  # fmt: skip


def main() -> None:
    """Print a table for each map."""
    parser = argparse.ArgumentParser(prog="python -m bench autonomy_plan", description=__doc__)
    parser.add_argument("--problems", type=int, default=200, help="a map, for ours (200)")
    parser.add_argument("--peers", type=int, default=40, help="of these, for OMPL's (40)")
    arguments = parser.parse_args()
    few = slice(arguments.peers)
    limits = limits_of(load_car("nigel"))
    with suppress(ModuleNotFoundError):
        from ompl import util

        util.RNG.setSeed(1)
    for name in MAPS:
        grid = grid_of_city(load_map(name))
        scene = scene_of(grid, limits)
        pairs = problems(grid, scene, arguments.problems)
        result = ours(grid, limits, pairs)
        reference = np.array(result.lengths)
        print(f"\n{name}\nplanner                problems    found  ms p50   ms p99   length"
              "   cusps   checks")  # fmt: skip
        show("Hybrid A*", result, reference)
        show("of these", Result(result.seconds[few], result.lengths[few], result.cusps[few]),
             reference[few])  # fmt: skip
        try:
            import ompl  # noqa: F401
        except ModuleNotFoundError:
            print("ompl is missing: pip install -e '.[bench]'")
            continue
        for planner in ("RRTConnect", "RRTstar"):
            for seconds in PEER_TIMES_S:
                peer = peers(planner, scene, limits, pairs[few], seconds)
                show(f"OMPL {planner} {seconds:g} s", peer, reference[few])


if __name__ == "__main__":
    main()
