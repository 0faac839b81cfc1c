"""What an agent may do: any throttle and steering, or one of a task's pairs of them by number."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction

from scm.arrays import Floats, Ints
from scm.gym.task import Task

Actions = Floats | Ints


def action_space(task: Task) -> spaces.Box | spaces.Discrete:
    """Return the space of one agent's actions."""
    return spaces.Discrete(len(task.choices)) if task.choices else spaces.Box(-1.0, 1.0, (2,))


def commands_of(task: Task, actions: Any, agents: Sequence[str | int]) -> Floats:
    """Return the throttle and steering, -1 to 1, that agents chose, (agents, 2).

    Args:
        task: With its choices.
        actions: One of each agent: (agents, 2) numbers, or (agents,) numbers of choices.
        agents: Their names or numbers, for errors.

    Raises:
        InvalidAction: They are no such actions.
    """
    given, count = np.asarray(actions), len(task.choices)
    expected = (len(agents),) if count else (len(agents), 2)
    if given.shape != expected:
        whose = f" of agent {agents[0]}" if len(agents) == 1 else "s"
        msg = f"action{whose} of shape {given.shape}: expected {expected}"
        raise InvalidAction(msg)
    if count:
        is_right = (given >= 0) & (given < count) & np.issubdtype(given.dtype, np.integer)
        range_ = f"a whole number from 0 to {count - 1}"
    else:
        given, range_ = given.astype(np.float64), "two numbers, -1 to 1"
        is_right = np.isfinite(given).all(axis=1)
    if not is_right.all():
        agent = int(np.argmin(is_right))
        msg = f"action of agent {agents[agent]} is {given[agent].tolist()}: expected {range_}"
        raise InvalidAction(msg)
    found: Floats = np.array(task.choices)[given] if count else given
    return found
