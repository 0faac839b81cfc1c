"""What people are shown of a car that parks itself: its plans, and what its planners avoid."""

import math

import numpy as np

from scm.arrays import Floats
from scm.v2x.grid_payload import packed
from scm.v2x.messages.autonomy_plan import AutonomyPlan, PlannedPose
from scm.v2x.messages.costmap import Costmap
from vehicle_agent.autonomy.grid_map import GridMap
from vehicle_agent.autonomy.parking import Parking

SHOWN, CANDIDATE_SHOWN = 100, 30  # particles, and poses of a path; of a candidate
COSTMAP_CELL_M, COSTMAP_CELLS = 0.02, 250_000
STEP_M, FARTHEST = 0.01, 255


def plan_of(parking: Parking, vehicle: str, t_ns: int) -> AutonomyPlan:
    """Return what a car plans."""
    navigator, found = parking.navigator, parking.perception.localised
    return AutonomyPlan(
        vehicle=vehicle,
        t_ns=t_ns,
        path=shown(None if navigator.path is None else navigator.path.poses),
        trajectory=shown(None if navigator.way is None else navigator.way.poses),
        particles=shown(None if found is None else found.particles),
        obstacles=tuple(map(tuple, parking.perception.obstacles.points().tolist())),
        candidates=tuple(shown(one.poses, CANDIDATE_SHOWN) for one in navigator.candidates),
    )


def costmap_of(parking: Parking, vehicle: str, t_ns: int) -> Costmap:
    """Return a car's clearance as it is now, in cells of at least `COSTMAP_CELL_M`."""
    grid, limits = parking.perception.obstacles.grid, parking.navigator.limits
    block = max(
        math.ceil(COSTMAP_CELL_M / grid.cell_m - 1e-9),
        math.ceil(math.sqrt(grid.cells.size / COSTMAP_CELLS)),
    )
    least = _least(grid, block)
    steps = np.clip(np.floor(least / STEP_M + 1e-9), 0, FARTHEST).astype(np.uint8)
    return Costmap(
        vehicle=vehicle,
        t_ns=t_ns,
        rows=steps.shape[0],
        columns=steps.shape[1],
        cell_m=block * grid.cell_m,
        x_m=grid.x_m,
        y_m=grid.y_m,
        step_m=STEP_M,
        half_width_m=min(limits.left_m, -limits.right_m),
        payload=packed(steps.tobytes()),
    )


def _least(grid: GridMap, block: int) -> Floats:
    """Return the least clearance of each square of block x block cells [m]."""
    whole = [(0, -n % block) for n in grid.cells.shape]
    fields = np.pad(grid.clearance_m, whole, "edge")
    rows, columns = fields.shape[0] // block, fields.shape[1] // block
    return np.asarray(fields.reshape(rows, block, columns, block).min(axis=(1, 3)))


def shown(poses: Floats | None, most: int = SHOWN) -> tuple[PlannedPose, ...]:
    """Return at most so many poses (n, 3), evenly taken, with the last."""
    if poses is None or len(poses) == 0:
        return ()
    some = np.unique(np.linspace(0, len(poses) - 1, min(most, len(poses))).round().astype(int))
    return tuple((x, y, yaw) for x, y, yaw in poses[some].round(4).tolist())
