"""Traverse an intersection that others traverse, too: AutoDRIVE's published task of four Nigels.

Observations, actions, rewards and ends are the published ones as far as they are known;
`docs/gym.md` says what differs. Source: Samak et al., "Multi-agent deep reinforcement learning for
cooperative and competitive autonomous vehicles using AutoDRIVE ecosystem", 2023, and its code.
"""

import numpy as np

from scm.arrays import Bools, Floats
from scm.gym.ends import touched, wrecked
from scm.gym.task import PlaceStart, Task, Term
from scm.gym.ways import AWAY_M
from scm.gym.worlds import Worlds

ARRIVED_M = 0.26  # half the width of the two lanes that a goal lies between
NEAREST_M = 0.001
ARMS = ("west", "south", "east", "north")  # counter-clockwise


def arrived(worlds: Worlds) -> Bools:
    """Return who is at its goal."""
    return worlds.to_goal.known[:, AWAY_M] <= ARRIVED_M


def arrival(worlds: Worlds) -> Floats:
    """Return 1 for each that arrives [1]."""
    return arrived(worlds).astype(float)


def nearness(worlds: Worlds) -> Floats:
    """Return how near each is to its goal [1/m]."""
    return 1.0 / (NEAREST_M + worlds.to_goal.known[:, AWAY_M])


def left_over(worlds: Worlds) -> Floats:
    """Return how far from its goal each is that ends without arriving [m]."""
    is_lost = (touched(worlds) | wrecked(worlds)) & ~arrived(worlds)
    return np.where(is_lost, worlds.to_goal.known[:, AWAY_M], 0.0)


TASK = Task(
    name="intersection",
    about="Cross an intersection without lights, straight on, four cars that share their states.",
    maps=("intersection_school",),
    observations=("goal_offset", "peers"),
    rewards=(Term(arrival, 1.0), Term(nearness, 0.01), Term(left_over, -0.425)),
    ends=(arrived, touched, wrecked),
    start=PlaceStart(
        places={"intersection_school": tuple(f"start_{arm}" for arm in ARMS)},
        goals={"intersection_school": tuple(f"goal_{arm}" for arm in ARMS)},
        is_paired=True,
        aside_m=0.1,
        turned_rad=0.05,
    ),
    choices=tuple((throttle, steering) for throttle in (0.5, 1.0) for steering in (1.0, 0.0, -1.0)),
    lasts_s=30.0,
    agents=4,
)
