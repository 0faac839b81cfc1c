"""One world of a task as a Gymnasium environment: a vector environment of one."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from scm.arrays import Image
from scm.gym.actions import Actions
from scm.gym.observations import Observation
from scm.gym.picture import RENDER_MODES
from scm.gym.vector import CityVectorEnv, Infos


class CityEnv(gymnasium.Env[Observation, Actions]):
    """One world of one task.

    Args:
        name: Of the task with its map, `driving_school/lap-v1`.
        options: As `CityVectorEnv` takes them.

    Attributes:
        observation_names: Of the observation's columns, each with its unit.

    Raises:
        gymnasium.error.Error: There is no such task, or it is of several agents.
        ScmError: There is no such car file.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES}  # noqa: RUF012 as its base has it

    def __init__(self, name: str, **options: Any) -> None:
        self._one = CityVectorEnv(
            name, 1, autoreset_mode=AutoresetMode.DISABLED, threads=1, **options
        )
        self.metadata, self.render_mode = self._one.metadata, self._one.render_mode
        self.observation_names = self._one.observation_names
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space

    def reset(
        self, *, seed: int | None = None, options: Infos | None = None
    ) -> tuple[Observation, Infos]:
        """Begin the next episode; with a seed, its first."""
        super().reset(seed=seed)
        return self._one.reset(seed=seed, options=options)[0][0], {}

    def step(self, action: Actions) -> tuple[Observation, float, bool, bool, Infos]:
        """Go on for one period with an action, two numbers or the number of a choice."""
        seen, reward, ended, over, _ = self._one.step(np.array([action]))
        return seen[0], float(reward[0]), bool(ended[0]), bool(over[0]), {}

    def render(self) -> Image | None:
        """Return a picture of the world, (height, width, 3); None: there is no `render_mode`."""
        pictures = self._one.render()
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        """Close it: it cannot be used any more."""
        self._one.close()
