"""Makes docs/pictures/planning.png: paths of Hybrid A* on Parking School, beside plain A*.

Run with `python docs/make/planning.py`; needs `pip install -e '.[docs]'`.
"""

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from drawing import plt

from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.vehicles.car import load_car
from vehicle_agent.autonomy import astar, hybrid_astar
from vehicle_agent.autonomy.grid_map import grid_of_city
from vehicle_agent.autonomy.plan import limits_of

OUT = Path(__file__).parents[1] / "pictures" / "planning.png"
BAY = Pose2(0.75, 0.0, 0.0)
CASES = (
    ("into the bay", Pose2(-0.7, 0.3, 0.0), BAY, None),
    ("out of the bay, and backward into it", Pose2(0.75, 0.0, 0.0), Pose2(0.9, 0.0, math.pi), None),
    ("back first, for room to turn", Pose2(0.3, 0.3, 1.2), BAY, None),
    ("round points that the map does not show", Pose2(-0.7, 0.0, 0.0), BAY,
     np.column_stack((np.full(30, -0.05), np.linspace(-0.15, 0.55, 30)))),
)  # fmt: skip


def main() -> None:
    """Draw a panel a case: forward blue, backward orange, plain A* dashed."""
    grid = grid_of_city(load_map("parking_school_obstacles"))
    limits = limits_of(load_car("nigel"))
    rows, columns = grid.cells.shape
    extent = (grid.x_m, grid.x_m + columns * grid.cell_m, grid.y_m, grid.y_m + rows * grid.cell_m)
    corners = [(u, v) for u in (limits.rear_m, limits.front_m) for v in (-1, 1)]
    outline = [(u, v * limits.left_m) for u, v in (corners[0], corners[2], corners[3], corners[1])]
    figure, panels = plt.subplots(2, 2, figsize=(11, 7))
    for panel, (title, start, goal, blocked) in zip(panels.flat, CASES, strict=True):
        path = hybrid_astar.plan(grid, limits, start, goal, blocked=blocked)
        panel.imshow(grid.cells, origin="lower", extent=extent, cmap="Greys", vmax=200)
        if blocked is None:
            line = astar.plan(grid, limits, start, goal)
            panel.plot(*line.poses[:, :2].T, "--", color="0.6", label="plain A*")
        else:
            panel.plot(*blocked.T, "r.", markersize=4, label="points")
        for pose in path.poses[:: max(1, len(path.poses) // 12)]:
            panel.fill(*zip(*(Pose2(*pose).apply(*corner) for corner in outline), strict=True),
                       fill=False, edgecolor="0.8", linewidth=0.7)  # fmt: skip
        for pose, color in ((start, "tab:green"), (goal, "tab:red")):
            panel.fill(*zip(*(pose.apply(*corner) for corner in outline), strict=True),
                       fill=False, edgecolor=color)  # fmt: skip
        for gear, color, label in ((1, "tab:blue", "forward"), (-1, "tab:orange", "backward")):
            at = np.flatnonzero(path.gears[1:] == gear)
            panel.plot(*path.poses[:, :2][np.stack((at, at + 1))].transpose(2, 0, 1), color=color)
            panel.plot([], [], color=color, label=label)
        panel.set(title=f"{title}: {path.length_m:.2f} m", xlabel="x [m]", ylabel="y [m]")
        panel.legend(loc="lower left", fontsize="small")
    figure.tight_layout()
    figure.savefig(OUT, dpi=80)


if __name__ == "__main__":
    main()
