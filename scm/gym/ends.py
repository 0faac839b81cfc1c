"""When a car's episode ends, beside its time limit: functions of all worlds, (rows,)."""

import numpy as np

from scm.arrays import Bools
from scm.gym.signals import PASSED_RED
from scm.gym.worlds import Worlds


def left_lane(worlds: Worlds) -> Bools:
    """Return whose rear axle has a wheel beyond the edge of its lane."""
    half_track = 0.5 * worlds.car.value("body.track_m")
    return np.abs(worlds.beside_m) + half_track > worlds.most_beside_m


def touched(worlds: Worlds) -> Bools:
    """Return who touches a wall, a box or another car."""
    return worlds.touched


def passed_red(worlds: Worlds) -> Bools:
    """Return whose front passed a line at red in this step."""
    if worlds.signals is None:
        return np.zeros(len(worlds.present), np.bool_)
    return worlds.signals.known[:, PASSED_RED] > 0.0


def wrecked(worlds: Worlds) -> Bools:
    """Return who rolled over, or left every physical range."""
    return worlds.is_wrecked
