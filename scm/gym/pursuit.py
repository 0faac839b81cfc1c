"""What a car knows of the one that it pursues: the first of its world that rules drive."""

import numpy as np

from scm.arrays import Floats, Ints
from scm.gym.ways import AWAY_M, COLUMNS, see
from scm.gym.worlds import Worlds

CLOSE_M = (0.4, 0.7)  # between the rear axles of two cars of 0.3 m
LOST_M = 2.0


def pursued_rows(worlds: Worlds) -> Ints:
    """Return the row of the car that each agent's pursues, (rows,)."""
    return np.repeat(worlds.cars[:, worlds.agents], worlds.agents)


def look(worlds: Worlds) -> Floats:
    """Return where the pursued car is, seen from each agent's: the columns of `ways`, (rows, 6)."""
    fleet, known = worlds.fleet, np.empty((worlds.rows, COLUMNS))
    rows = pursued_rows(worlds)
    poses = np.column_stack((fleet.x[rows], fleet.y[rows], fleet.yaw[rows]))
    see(poses, fleet.x, fleet.y, fleet.yaw, np.arange(worlds.rows), known)
    return known


def away_m(worlds: Worlds) -> Floats:
    """Return how far the rear axle of the pursued car is from each agent's, (rows,)."""
    return look(worlds)[:, AWAY_M]
