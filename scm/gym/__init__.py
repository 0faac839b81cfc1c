"""The city as a training environment: Gymnasium's and PettingZoo's interfaces over one fleet.

    names          a task with its map: driving_school/lap-v1
    tasks          what is to be learned, one file each
    task           what a task is made of
    worlds         many worlds of a task, their cars rows of one fleet
    ways           where its cars begin, and how far they come: along lanes, or to a goal
    junctions      signals that agents choose, behind the city's own kernel
    touching       who touches a wall or another car
    traffic        cars of a world that rules drive
    pursuit        where the car is that another pursues
    observations   what an agent sees of it
    camera         what its front camera sees
    actions        what it may do
    rewards, ends  what it gains, and when its episode ends
    picture        a world from above
    vector         as a Gymnasium vector environment
    single         as a Gymnasium environment
    radio          what cars of a world know of each other
    parallel       several agents in one world, as a PettingZoo environment

Needs the extra scm[gym].
"""

from typing import Any

import gymnasium

from scm.gym.names import ids, task_of
from scm.gym.parallel import CityParallelEnv
from scm.gym.single import CityEnv
from scm.gym.vector import CityVectorEnv

__all__ = ["CityEnv", "CityParallelEnv", "CityVectorEnv", "make_vec", "parallel_env"]


def make_vec(name: str, num_envs: int = 1, **options: Any) -> CityVectorEnv:
    """Return many worlds of a task, `num_envs` agents in all; see `CityVectorEnv`.

    Raises:
        gymnasium.error.Error: There is no such task, or no whole number of worlds.
        ScmError: There is no such map or car file.
    """
    return CityVectorEnv(name, num_envs, **options)


def parallel_env(name: str, **options: Any) -> CityParallelEnv:
    """Return one world of a task of several agents; see `CityParallelEnv`.

    Raises:
        gymnasium.error.Error: There is no such task.
        ScmError: There is no such map or car file.
    """
    return CityParallelEnv(name, **options)


for _name in ids():
    if _name not in gymnasium.registry:
        gymnasium.register(
            _name,
            entry_point="scm.gym.single:CityEnv" if task_of(_name)[0].agents == 1 else None,
            vector_entry_point="scm.gym.vector:CityVectorEnv", kwargs={"name": _name},
        )  # fmt: skip
