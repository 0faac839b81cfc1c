"""The worlds of a task as a Gymnasium vector environment, without a loop over worlds."""

import os
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, Error, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from scm.arrays import Bools, Floats, Image, Ints
from scm.gym.actions import Actions, action_space, checked
from scm.gym.names import task_of
from scm.gym.observations import Observation, Observations
from scm.gym.picture import Picture, checked_mode, metadata_of
from scm.gym.worlds import Options, Worlds

Infos = dict[str, Any]


class CityVectorEnv(VectorEnv[Observation, Actions, Any]):
    """Many worlds of one task: each of its agents is a sub-environment.

    Of a task of several agents, agent a of world w is row `w * agents + a` of every array. A world
    begins its next episode as a whole, when all of its agents have ended; `infos["present"]`,
    (num_envs,), says who takes part in the next step. Who does not, gains nothing by it, reports no
    end, and its observation says nothing.

    Args:
        name: Of the task with its map, `driving_school/lap-v1`.
        num_envs: How many agents, over all worlds; a multiple of the task's agents.
        autoreset_mode: When a world whose agents have all ended begins its next episode: in the
            next step, in the same one, or by `reset` alone.
        threads: For the physics; None: one a core.
        copy: Whether each observation is an array of its own; else the next step writes over it.
        render_mode: `rgb_array`: `render` returns pictures, one of each world.
        options: Of `Options`: other actions, observations or car, what is drawn for each episode.

    Attributes:
        name: As it was given.
        observation_names: Of the observation's columns, each with its unit.

    Raises:
        gymnasium.error.Error: There is no such task, or no whole number of worlds.
        ScmError: There is no such car file.
    """

    def __init__(
        self, name: str, num_envs: int = 1, *, autoreset_mode: AutoresetMode | str = "NextStep",
        threads: int | None = None, copy: bool = True, render_mode: str | None = None,
        **options: Any,
    ) -> None:  # fmt: skip
        task, map_name = task_of(name)
        worlds, rest = divmod(num_envs, task.agents)
        if worlds < 1 or rest:
            each = f"a multiple of {task.agents}, the agents of a world" if task.agents > 1 else ""
            msg = f"num_envs = {num_envs}: expected {each or '1 or more'}"
            raise Error(msg)
        self.name, self.num_envs, self._copy = name, num_envs, copy
        self._mode = AutoresetMode(autoreset_mode)
        self.metadata = metadata_of(task) | {"autoreset_mode": self._mode}
        self.render_mode = checked_mode(render_mode)
        threads = threads or len(os.sched_getaffinity(0))
        self.worlds = Worlds(task, map_name, worlds, Options(**options), threads)
        self._seen = Observations(self.worlds, self.worlds.task.observations)
        self.observation_names = self._seen.names
        self.single_observation_space = spaces.Box(self._seen.low, self._seen.high)
        self.single_action_space = self._space = action_space(self.worlds)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._every: Bools = np.ones(num_envs, np.bool_)
        self._is_begun = False
        self._picture: Picture | None = None

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Infos | None = None
    ) -> tuple[Observation, Infos]:
        """Begin episodes: of all worlds, or of those in `options["reset_mask"]`.

        Args:
            seed: Of the first world; each other's is higher by one. Or one for each; None: it goes
                on with the next episode of the seed that it has.
            options: `reset_mask`, (num_envs,) of bool: all agents of a world, or none.
        """
        self._check_open()
        which = self._mask(options)
        if seed is None and not self._is_begun:
            seed = int(self.np_random.integers(2**31))
        if isinstance(seed, int):
            seed = [seed + k for k in range(self.worlds.count)]
        if seed is not None:
            numbers = self._seeds(seed)
            given = np.array([one is not None for one in seed]) & which
            self.worlds.seed(np.flatnonzero(given), numbers[given])
        self.worlds.begin(which)
        self._is_begun = True
        return self._observed(), self._infos()

    def step(self, actions: Actions) -> tuple[Observation, Floats, Bools, Bools, Infos]:
        """Let all worlds go on for one period.

        Args:
            actions: Two numbers of each agent, (num_envs, 2); or numbers of choices, (num_envs,).
        """
        self._check_open()
        if not self._is_begun:
            msg = "step before reset: call reset first"
            raise ResetNeeded(msg)
        worlds = self.worlds
        given = checked(self._space, actions, range(self.num_envs))
        are_over = worlds.are_out
        if are_over.any() and self._mode is AutoresetMode.DISABLED:
            msg = f"world {int(np.argmax(are_over))} ended: reset it, by options['reset_mask']"
            raise ResetNeeded(msg)
        worlds.step(given)
        rewards, ends = worlds.rewards(), worlds.ends()
        late = worlds.out_of_time & ~ends
        worlds.remove(ends | late)
        infos: Infos = {}
        if are_over.any():  # their step was this: to begin
            worlds.begin(are_over)
        elif self._mode is AutoresetMode.SAME_STEP and (ends | late).any():
            infos = self._final(ends | late)
            worlds.begin(worlds.are_out)
        return self._observed(), rewards, ends, late, infos | self._infos()

    def render(self) -> tuple[Image, ...] | None:
        """Return a picture of each world, (height, width, 3); None: there is no `render_mode`."""
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = Picture(self.worlds)
        return tuple(self._picture.of(world) for world in range(self.worlds.count))

    def _infos(self) -> Infos:
        return {"present": self.worlds.present.copy(), "_present": self._every}

    def _final(self, ended: Bools) -> Infos:
        """Return the last observations of the agents whose episode ended in this step."""
        last = self._seen.update()
        final = np.full(self.num_envs, None, dtype=object)
        for k in np.flatnonzero(ended).tolist():
            final[k] = last[k].copy()
        return {"final_obs": final, "_final_obs": ended, "final_info": {}, "_final_info": ended}

    def _observed(self) -> Observation:
        seen = self._seen.update()
        return seen.copy() if self._copy else seen

    def _check_open(self) -> None:
        if self.closed:
            msg = "this environment is closed: make another"
            raise ClosedEnvironmentError(msg)

    def _seeds(self, seeds: list[int | None]) -> Ints:
        if len(seeds) != self.worlds.count:
            msg = f"{len(seeds)} seeds: expected one for each of {self.worlds.count} worlds"
            raise ValueError(msg)
        return np.array([one or 0 for one in seeds], np.int64)

    def _mask(self, options: Infos | None) -> Bools:
        """Return which worlds to begin anew, (worlds,)."""
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.worlds.count, np.bool_)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            msg = f"options['reset_mask']: expected an array of bool, got {mask!r}"
            raise TypeError(msg)
        if mask.shape != (self.num_envs,) or not mask.any():
            msg = (
                f"options['reset_mask']: expected shape ({self.num_envs},) with an agent in it, "
                f"got {mask.shape} with {int(mask.sum())}"
            )
            raise ValueError(msg)
        by_world = mask.reshape(self.worlds.count, -1)
        which: Bools = np.asarray(by_world.any(axis=1))
        if not by_world[which].all():
            world = int(np.argmax(which & ~by_world.all(axis=1)))
            msg = f"options['reset_mask']: expected all agents of world {world}, or none"
            raise ValueError(msg)
        return which
