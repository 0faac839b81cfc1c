"""One world of several agents as a PettingZoo parallel environment."""

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, InvalidAction, ResetNeeded
from numpy.random import default_rng
from pettingzoo import ParallelEnv

from scm.arrays import Bools, Image
from scm.gym.actions import Actions, Space, action_space, checked
from scm.gym.names import task_of
from scm.gym.observations import Observation, Observations
from scm.gym.picture import Picture, checked_mode, metadata_of
from scm.gym.worlds import Options, Worlds

Infos = dict[str, dict[str, Any]]


class CityParallelEnv(ParallelEnv[str, Observation, Actions]):  # type: ignore[misc]  # untyped
    """One world of one task; each of its cars is an agent.

    A car whose episode ended is taken away, and is an agent no more until the next reset.

    Args:
        name: Of the task with its map, `driving_school/crossing-v1`.
        render_mode: `rgb_array`: `render` returns pictures.
        options: Of `Options`: other actions, observations or car, what is drawn for each episode.

    Attributes:
        name: As it was given.
        observation_names: Of the observation's columns, each with its unit.

    Raises:
        gymnasium.error.Error: There is no such task.
        ScmError: There is no such map or car file.
    """

    def __init__(self, name: str, render_mode: str | None = None, **options: Any) -> None:
        task, map_name = task_of(name)
        self.metadata = metadata_of(task) | {"name": f"{task.name}-v{task.version}"}
        self.name, self.render_mode = name, checked_mode(render_mode)
        self._picture: Picture | None = None
        self.worlds = Worlds(task, map_name, 1, Options(**options))
        self._seen = Observations(self.worlds, self.worlds.task.observations)
        self.observation_names = self._seen.names
        self.possible_agents = list(self.worlds.agent_names)
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: spaces.Box(self._seen.low, self._seen.high) for agent in self.possible_agents
        }
        self.action_spaces = dict.fromkeys(self.possible_agents, action_space(self.worlds))
        self._is_begun = self._is_closed = False

    def observation_space(self, agent: str) -> spaces.Box:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], Infos]:
        """Begin the next episode; with a seed, its first."""
        del options
        self._check_open()
        if seed is None and not self._is_begun:
            seed = int(default_rng().integers(2**31))
        if seed is not None:
            self.worlds.seed(np.zeros(1, np.int64), np.array([seed]))
        self.worlds.begin(np.ones(1, np.bool_))
        self.agents, self._is_begun = list(self.possible_agents), True
        return self._of_agents(self._seen.update().copy()), {agent: {} for agent in self.agents}

    def step(
        self, actions: dict[str, Actions]
    ) -> tuple[
        dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], Infos
    ]:  # fmt: skip
        """Let all agents go on for one period."""
        self._check_open()
        if not self._is_begun:
            msg = "step before reset: call reset first"
            raise ResetNeeded(msg)
        worlds, space = self.worlds, self.action_spaces[self.possible_agents[0]]
        dtype = np.int64 if isinstance(space, spaces.Discrete) else np.float64
        given: Any = np.zeros((len(self.possible_agents), *(space.shape or ())), dtype)
        for row, agent in enumerate(self.possible_agents):
            if agent in self.agents:
                given[row] = self._checked(actions, agent)
        worlds.step(given)
        rewards, ends = worlds.rewards(), worlds.ends()
        over = worlds.out_of_time & ~ends
        seen = self._of_agents(self._seen.update().copy())
        gained = self._of_agents(rewards.tolist())
        ended, out_of_time = self._of_agents(ends.tolist()), self._of_agents(over.tolist())
        infos: Infos = {agent: {} for agent in self.agents}
        self._remove(ends | over)
        return seen, gained, ended, out_of_time, infos

    def render(self) -> Image | None:
        """Return a picture of the world, (height, width, 3); None: there is no `render_mode`."""
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = Picture(self.worlds)
        return self._picture.of()

    def close(self) -> None:
        """Close it: it cannot be used any more."""
        self._is_closed = True

    def _remove(self, rows: Bools) -> None:
        self.worlds.remove(rows)
        pairs = zip(self.possible_agents, rows.tolist(), strict=True)
        gone = {agent for agent, is_out in pairs if is_out}
        self.agents = [agent for agent in self.agents if agent not in gone]

    def _of_agents(self, values: Any) -> dict[str, Any]:
        """Return what is of each car (cars, ...) by agent, of those that take part."""
        rows = {agent: row for row, agent in enumerate(self.possible_agents)}
        return {agent: values[rows[agent]] for agent in self.agents}

    def _checked(self, actions: dict[str, Actions], agent: str) -> Any:
        if agent not in actions:
            msg = f"no action of {agent}: expected one of each of {', '.join(self.agents)}"
            raise InvalidAction(msg)
        return checked(self.action_spaces[agent], [actions[agent]], [agent])[0]

    def _check_open(self) -> None:
        if self._is_closed:
            msg = "this environment is closed: make another"
            raise ClosedEnvironmentError(msg)
