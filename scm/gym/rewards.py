"""What a car gains in a step: small functions of all worlds, each with its unit, (rows,)."""

import numpy as np

from scm.arrays import Floats
from scm.gym import ends
from scm.gym.pursuit import CLOSE_M, away_m
from scm.gym.worlds import Worlds
from scm.vehicles.drivers.course import BESIDE_M, TURNED_RAD

STANDS_MPS = 0.02


def progress(worlds: Worlds) -> Floats:
    """Return how far each car came along its lanes [m]."""
    return worlds.lanes.moved_m


def off_centre(worlds: Worlds) -> Floats:
    """Return how far each is from the middle of its lane, as a share of half its width [1]."""
    return np.abs(worlds.lanes.known[:, BESIDE_M]) / worlds.lanes.half_width


def turned(worlds: Worlds) -> Floats:
    """Return how far each is turned from its lane's direction [rad]."""
    return np.abs(worlds.lanes.known[:, TURNED_RAD])


def goal_progress(worlds: Worlds) -> Floats:
    """Return how much nearer each car came to its goal [m]."""
    return worlds.to_goal.nearer[:, 0]


def goal_turn_progress(worlds: Worlds) -> Floats:
    """Return how much less than before each is turned from its goal's direction [rad]."""
    return worlds.to_goal.nearer[:, 1]


def parked(worlds: Worlds) -> Floats:
    """Return 1 for each that is parked [1]."""
    return ends.parked(worlds).astype(float)


def contact(worlds: Worlds) -> Floats:
    """Return 1 for each that touches a wall, a box or another car [1]."""
    return worlds.touched.astype(float)


def close(worlds: Worlds) -> Floats:
    """Return 1 for each whose rear axle is 0.4 to 0.7 m from that of the car it pursues [1]."""
    (least, most), away = CLOSE_M, away_m(worlds)
    return ((least <= away) & (away <= most)).astype(float)


def too_far(worlds: Worlds) -> Floats:
    """Return how much farther than 0.7 m the pursued car is away [m]."""
    return np.maximum(0.0, away_m(worlds) - CLOSE_M[1])


def steering_change(worlds: Worlds) -> Floats:
    """Return how far each steers otherwise than in the step before [1]."""
    return np.abs(worlds.actions[:, 1] - worlds.before[:, 1])


def throttle_change(worlds: Worlds) -> Floats:
    """Return how far the throttle of each is another than in the step before [1]."""
    return np.abs(worlds.actions[:, 0] - worlds.before[:, 0])


def standing(worlds: Worlds) -> Floats:
    """Return 1 for each that moves slower than 0.02 m/s [1]."""
    return (np.abs(worlds.fleet.speed[: worlds.rows]) < STANDS_MPS).astype(float)


def failed(worlds: Worlds) -> Floats:
    """Return 1 for each whose episode ends in this step, not by its time limit [1]."""
    return worlds.ends().astype(float)
