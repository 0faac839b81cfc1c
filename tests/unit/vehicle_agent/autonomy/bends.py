"""Floors with boxes, and paths of bends, for planners to drive."""

import math

import numpy as np

from scm.geometry import Pose2
from vehicle_agent.autonomy.grid_map import FREE, OCCUPIED, grid_of_cells
from vehicle_agent.autonomy.plan import Path

START = Pose2(0.5, 1.0, 0.0)


def floor(*boxes):
    """Return a floor of 3 by 2 m with boxes (left, low, right, high) [m]."""
    cells = np.full((200, 300), FREE, np.int8)
    for left, low, right, high in boxes:
        cells[round(100 * low) : round(100 * high), round(100 * left) : round(100 * right)] = (
            OCCUPIED
        )
    return grid_of_cells(cells, 0.01, 0.0, 0.0)


def path_of(*parts):
    """Return a path from START of parts (length, negative backward [m], curvature [1/m])."""
    poses, gears, curvatures = [START], [], []
    for length, bend in parts:
        count = round(abs(length) / 0.02)
        for _ in range(count):
            step, (x, y, yaw) = length / count, poses[-1]
            middle = yaw + 0.5 * step * bend
            poses.append(
                Pose2(x + step * math.cos(middle), y + step * math.sin(middle), yaw + step * bend)
            )
            gears.append(math.copysign(1.0, length))
            curvatures.append(bend)
    return Path(
        np.array(poses), np.array([gears[0], *gears]), np.array([curvatures[0], *curvatures])
    )
