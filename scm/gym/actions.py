"""What an agent may do: any throttle and steering, or one of some choices by number."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction

from scm.arrays import Floats, Ints
from scm.gym.worlds import Worlds

Actions = Floats | Ints
Space = spaces.Box | spaces.Discrete


def action_space(worlds: Worlds) -> Space:
    """Return the space of one agent's actions."""
    junctions = worlds.junctions
    count = len(worlds.task.choices) if junctions is None else junctions.choices
    return spaces.Discrete(count) if count else spaces.Box(-1.0, 1.0, (2,))


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
        given, range_ = given.astype(np.float64), "two numbers, -1 to 1"
        is_right = np.isfinite(given).all(axis=1)
    if not is_right.all():
        agent = int(np.argmin(is_right))
        msg = f"action of agent {agents[agent]} is {given[agent].tolist()}: expected {range_}"
        raise InvalidAction(msg)
    return given
