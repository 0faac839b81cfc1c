"""When a car's episode ends, beside its time limit: functions of all worlds, (rows,)."""

import numpy as np

from scm.arrays import Bools
from scm.gym.pursuit import LOST_M, away_m
from scm.gym.signals import PASSED_RED
from scm.gym.ways import AWAY_M, TURNED_RAD
from scm.gym.worlds import Worlds
from scm.vehicles.drivers.course import BESIDE_M
from scm.vehicles.parked import is_parked


def left_lane(worlds: Worlds) -> Bools:
    """Return whose rear axle has a wheel beyond the edge of its lane."""
    half_track, lanes = 0.5 * worlds.car.value("body.track_m"), worlds.lanes
    return np.abs(lanes.known[:, BESIDE_M]) + half_track > lanes.half_width


def parked(worlds: Worlds) -> Bools:
    """Return who stands at its goal, within the tolerances of cars that park themselves."""
    known = worlds.to_goal.known
    return is_parked(known[:, AWAY_M], known[:, TURNED_RAD], worlds.fleet.speed[: worlds.rows])


def lost(worlds: Worlds) -> Bools:
    """Return whose pursued car is more than 2 m away."""
    return away_m(worlds) > LOST_M


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
