"""The worlds of a task as a Gymnasium vector environment, without a loop over worlds."""

import os
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, Error, InvalidAction, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from scm.arrays import Bools, Floats, Ints
from scm.gym.names import task_of
from scm.gym.observations import Observation, Observations
from scm.gym.worlds import Options, Worlds

Infos = dict[str, Any]


class CityVectorEnv(VectorEnv[Observation, Floats, Any]):
    """Many worlds of one task.

    Args:
        name: Of the task with its map, `driving_school/lap-v1`.
        num_envs: How many worlds.
        autoreset_mode: When a world whose episode ended begins its next one.
        threads: For the physics; None: one a core.
        copy: Whether each observation is an array of its own; else the next step writes over it.
        options: Of `Options`: another car file, and what is drawn for each episode.

    Attributes:
        name: As it was given.
        observation_names: Of the observation's columns, each with its unit.

    Raises:
        gymnasium.error.Error: There is no such task, it is of several agents, or of no world.
        ScmError: There is no such car file.
    """

    def __init__(
        self, name: str, num_envs: int = 1, *, autoreset_mode: AutoresetMode | str = "NextStep",
        threads: int | None = None, copy: bool = True, **options: Any,
    ) -> None:  # fmt: skip
        task, map_name = task_of(name)
        if task.agents > 1:
            msg = f"{name} is of {task.agents} agents: make it by scm.gym.parallel_env"
            raise Error(msg)
        if num_envs < 1:
            msg = f"num_envs = {num_envs}: expected 1 or more"
            raise Error(msg)
        self.name, self.num_envs, self._copy = name, num_envs, copy
        self._mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        threads = threads or len(os.sched_getaffinity(0))
        self.worlds = Worlds(task, map_name, num_envs, Options(**options), threads)
        self._seen = Observations(self.worlds, task.observations)
        self.observation_names = self._seen.names
        self.single_observation_space = spaces.Box(self._seen.low, self._seen.high)
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended: Bools = np.zeros(num_envs, np.bool_)
        self._is_begun = False

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Infos | None = None
    ) -> tuple[Observation, Infos]:
        """Begin episodes: of all worlds, or of those in `options["reset_mask"]`.

        Args:
            seed: Of the first world; each other's is higher by one. Or one for each; None: it goes
                on with the next episode of the seed that it has.
            options: `reset_mask`, (num_envs,) of bool.
        """
        self._check_open()
        which = self._mask(options)
        if isinstance(seed, int):
            seed = [seed + k for k in range(self.num_envs)]
        if seed is None and not self._is_begun:
            first = int(self.np_random.integers(2**31))
            seed = [first + k for k in range(self.num_envs)]
        if seed is not None:
            numbers = self._seeds(seed)
            given = np.array([one is not None for one in seed]) & which
            self.worlds.seed(np.flatnonzero(given), numbers[given])
        self.worlds.begin(which)
        self._ended[which], self._is_begun = False, True
        return self._observed(), {}

    def step(self, actions: Floats) -> tuple[Observation, Floats, Bools, Bools, Infos]:
        """Let all worlds go on for one period with actions (num_envs, 2): throttle, steering."""
        self._check_open()
        if not self._is_begun:
            msg = "step before reset: call reset first"
            raise ResetNeeded(msg)
        given = self._checked(actions)
        fresh = self._ended.copy()
        if fresh.any() and self._mode is AutoresetMode.DISABLED:
            msg = f"world {int(np.argmax(fresh))} ended: reset it first, by options['reset_mask']"
            raise ResetNeeded(msg)
        worlds = self.worlds
        worlds.step(given)
        rewards, ends, over = worlds.rewards(), worlds.ends(), worlds.is_over
        infos: Infos = {}
        if fresh.any():  # their step was this: to begin
            worlds.begin(fresh)
            rewards[fresh], ends[fresh], over[fresh] = 0.0, False, False
        over &= ~ends
        self._ended = ends | over
        if self._ended.any() and self._mode is AutoresetMode.SAME_STEP:
            infos = self._final()
            worlds.begin(self._ended)
            self._ended = np.zeros(self.num_envs, np.bool_)
        return self._observed(), rewards, ends, over, infos

    def _final(self) -> Infos:
        """Return the last observations of the worlds whose episode ended."""
        last, ended = self._seen.update(), self._ended.copy()
        final = np.full(self.num_envs, None, dtype=object)
        for k in np.flatnonzero(ended).tolist():
            final[k] = last[k].copy()
        return {"final_obs": final, "_final_obs": ended, "final_info": {}, "_final_info": ended}

    def _observed(self) -> Observation:
        seen = self._seen.update()
        return seen.copy() if self._copy else seen

    def _checked(self, actions: Floats) -> Floats:
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != (self.num_envs, 2):
            msg = f"actions of shape {given.shape}: expected ({self.num_envs}, 2)"
            raise InvalidAction(msg)
        if not np.isfinite(given).all():
            world = int(np.argmin(np.isfinite(given).all(axis=1)))
            msg = f"action of world {world} is {given[world].tolist()}: expected numbers, -1 to 1"
            raise InvalidAction(msg)
        return given

    def _check_open(self) -> None:
        if self.closed:
            msg = "this environment is closed: make another"
            raise ClosedEnvironmentError(msg)

    def _seeds(self, seeds: list[int | None]) -> Ints:
        if len(seeds) != self.num_envs:
            msg = f"{len(seeds)} seeds: expected one for each of {self.num_envs} worlds"
            raise ValueError(msg)
        return np.array([one or 0 for one in seeds], np.int64)

    def _mask(self, options: Infos | None) -> Bools:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, np.bool_)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            msg = f"options['reset_mask']: expected an array of bool, got {mask!r}"
            raise TypeError(msg)
        if mask.shape != (self.num_envs,) or not mask.any():
            msg = (
                f"options['reset_mask']: expected shape ({self.num_envs},) with a world in it, got "
                f"{mask.shape} with {int(mask.sum())}"
            )
            raise ValueError(msg)
        return mask
