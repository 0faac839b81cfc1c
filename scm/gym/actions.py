"""What an agent may do: throttle and steering, speed and curvature, or one of some choices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import Error, InvalidAction

from scm.arrays import Floats, Ints
from scm.geometry import Pose2
from scm.gym.task import Task
from scm.records.policy import COMMANDS, SPEED_CURVATURE
from scm.vehicles.car import Car
from scm.vehicles.drivers.limits import turning_radius_m
from scm.vehicles.fleet import Fleet

if TYPE_CHECKING:
    from scm.gym.worlds import Worlds

Actions = Floats | Ints
Space = spaces.Box | spaces.Discrete
KINDS = {"throttle_steering": COMMANDS, "speed_curvature": SPEED_CURVATURE}
FULL_THROTTLE_S = 10.0  # after which a car is as fast as it gets


def names_of(task: Task, kind: str) -> tuple[str, str]:
    """Return the names of an action's columns.

    Raises:
        gymnasium.error.Error: There is no such kind of action, or not in this task.
    """
    if kind not in KINDS:
        msg = f"action = {kind!r}: expected {' or '.join(KINDS)}"
        raise Error(msg)
    if kind == "speed_curvature" and (task.choices or task.of_junctions):
        msg = f"action = {kind!r}: the actions of {task.name} are choices by number"
        raise Error(msg)
    return KINDS[kind]


def reach_of(car: Car, names: tuple[str, str]) -> Floats:
    """Return the largest action, (2,): for speed and curvature, what a car reaches on the level."""
    if names == COMMANDS:
        return np.ones(2)
    fleet = Fleet(car, 1)
    fleet.add(Pose2(0.0, 0.0, 0.0))
    fleet.throttle[:] = 1.0
    fleet.advance(FULL_THROTTLE_S)
    reach = np.array([fleet.speed[0], 1.0 / turning_radius_m(car)], np.float32)
    return reach.astype(np.float64)


def action_space(worlds: Worlds) -> Space:
    """Return the space of one agent's actions."""
    junctions = worlds.junctions
    count = len(worlds.task.choices) if junctions is None else junctions.choices
    if count:
        return spaces.Discrete(count)
    high = worlds.reach.astype(np.float32)
    return spaces.Box(-high, high)


def checked(space: Space, actions: Any, agents: Sequence[str | int]) -> Actions:
    """Return the actions of agents as an array.

    Args:
        space: Of one agent's.
        actions: One of each agent: (agents, 2) numbers, or (agents,) numbers of choices.
        agents: Their names or numbers, for errors.

    Raises:
        InvalidAction: They are no such actions.
    """
    given, expected = np.asarray(actions), (len(agents), *(space.shape or ()))
    if given.shape != expected:
        whose = f" of agent {agents[0]}" if len(agents) == 1 else "s"
        msg = f"action{whose} of shape {given.shape}: expected {expected}"
        raise InvalidAction(msg)
    if isinstance(space, spaces.Discrete):
        is_right = (given >= 0) & (given < space.n) & np.issubdtype(given.dtype, np.integer)
        range_ = f"a whole number from 0 to {space.n - 1}"
    else:
        given = given.astype(np.float64)
        is_right = np.isfinite(given).all(axis=1)
        ranges = zip(space.low.tolist(), space.high.tolist(), strict=True)
        range_ = "two numbers, " + " and ".join(f"{low:g} to {high:g}" for low, high in ranges)
    if not is_right.all():
        agent = int(np.argmin(is_right))
        msg = f"action of agent {agents[agent]} is {given[agent].tolist()}: expected {range_}"
        raise InvalidAction(msg)
    return given
