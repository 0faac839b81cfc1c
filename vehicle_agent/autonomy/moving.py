"""Other cars that move, as discs that go on as they do: from what they report by radio.

Cars that stand are left to the scanner, which sees their outline as it is.
"""

import math
from collections.abc import Iterable

import numpy as np

from scm.arrays import Floats
from scm.vehicles.driver import Other
from vehicle_agent.autonomy.plan import CarLimits

STANDS_MPS = 0.02  # a slower car stands
DISCS = 3  # that cover a car, one behind the other
CLEAR_M = 0.02  # that a car leaves to them


def discs_of(others: Iterable[Other]) -> Floats:
    """Return discs (k, 5): x, y [m], vx, vy [m/s] and radius [m] of each, now."""
    rows = []
    for car in others:
        if abs(car.speed) < STANDS_MPS:
            continue
        c, s, part = math.cos(car.yaw), math.sin(car.yaw), car.length / DISCS
        radius = math.hypot(0.5 * part, 0.5 * car.width)
        for number in range(DISCS):
            ahead = (number - 0.5 * (DISCS - 1)) * part
            x, y = car.x + ahead * c, car.y + ahead * s
            rows.append((x, y, car.speed * c, car.speed * s, radius))
    return np.array(rows).reshape(-1, 5)


def comes_near(poses: Floats, when_s: Floats, discs: Floats, limits: CarLimits) -> bool:
    """Return whether a disc comes within `CLEAR_M` of a car that drives on.

    Args:
        poses: (n, 3) of the car's rear axle.
        when_s: (n,) from now.
        discs: As `discs_of` returns them.
        limits: Of the car.
    """
    if len(discs) == 0:
        return False
    x, y, yaw = (column[:, None] for column in poses.T)
    dx = discs[:, 0] + when_s[:, None] * discs[:, 2] - x
    dy = discs[:, 1] + when_s[:, None] * discs[:, 3] - y
    along, across = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
    beyond = np.maximum(np.maximum(limits.rear_m - along, along - limits.front_m), 0.0)
    beside = np.maximum(np.maximum(limits.right_m - across, across - limits.left_m), 0.0)
    return bool((np.hypot(beyond, beside) < discs[:, 4] + CLEAR_M).any())
