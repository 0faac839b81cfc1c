"""Every task keeps the contracts of Gymnasium or PettingZoo, and says what its agents see."""

import re
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

import scm.gym
from scm.gym.names import all_tasks, ids

UNITS = re.compile(
    r".*_(m|mps|mps2|rad|radps|s|cars)|throttle|steering|(other_\d+|goal|pursued)_(cos|sin)_turn|"
    r"(signal|group_\d+)_is_green|stage_\d+_is_chosen"
)
STEPS, WORLDS = 150, 7
OF_ONE = [name for name in ids() if gymnasium.spec(name).entry_point is not None]
OF_SEVERAL = [
    f"{map_name}/{task.name}-v{task.version}"
    for task in all_tasks().values()
    for map_name in task.maps
    if task.agents > 1
]


@pytest.mark.parametrize("name", OF_ONE)
def test_gymnasium_finds_nothing_wrong(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(name).unwrapped)


@pytest.mark.parametrize("name", OF_ONE)
def test_stable_baselines3_finds_nothing_wrong(name):
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker",
        reason="stable-baselines3 is not installed: it needs torch, which scm does not",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gymnasium.make(name))


@pytest.mark.parametrize("name", OF_SEVERAL)
def test_pettingzoo_finds_nothing_wrong(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(scm.gym.parallel_env(name), 150)
        parallel_seed_test(lambda: scm.gym.parallel_env(name), 50)


@pytest.mark.parametrize("name", ids())
def test_observations_have_names_with_units_and_stay_in_their_space(name):
    envs = gymnasium.make_vec(name, num_envs=8)
    names = envs.observation_names
    assert len(set(names)) == len(names) == envs.single_observation_space.shape[0]
    assert not [one for one in names if not UNITS.fullmatch(one)]
    envs.action_space.seed(1)
    seen, _ = envs.reset(seed=1)
    moved = np.zeros(len(names), bool)
    for _ in range(60):
        now, gain, *_ = envs.step(np.abs(envs.action_space.sample()))
        assert envs.observation_space.contains(now)
        assert np.isfinite(gain).all()
        moved |= (now != seen).any(axis=0)
    still = [one for one, does in zip(names, moved, strict=True) if not does]
    assert still in ([], ["speed_limit_mps"])


@pytest.mark.parametrize("task", all_tasks().values(), ids=lambda task: task.name)
def test_world_is_the_same_bit_by_bit_whatever_their_number(task):
    """Over ends and new beginnings, where the task has any; cars differ."""
    name = f"{task.maps[0]}/{task.name}-v{task.version}"
    drawn = np.random.default_rng(1).random((STEPS, WORLDS * task.agents, 2))

    def played(first, count):
        these = slice(first * task.agents, (first + count) * task.agents)
        envs = scm.gym.make_vec(name, count * task.agents, randomise=1.0)
        seen, ended = [envs.reset(seed=40 + first)[0]], 0
        choices = getattr(envs.single_action_space, "n", 0)
        for one in drawn[:, these]:
            along = one * (1.0, 0.4) - (0.0, 0.1)  # forward, and slowly off the lane
            now, gain, end, *_ = envs.step((choices * one[:, 0]).astype(int) if choices else along)
            seen.append(np.column_stack((now, gain, end)))
            ended += end.sum()
        return seen, ended

    together, ended = played(0, WORLDS)
    assert ended or not task.ends
    alone, _ = played(3, 2)
    rows = slice(3 * task.agents, 5 * task.agents)
    for one, other in zip(together, alone, strict=True):
        np.testing.assert_array_equal(one[rows], other)


def test_each_task_is_described_and_its_maps_exist():
    for name, task in all_tasks().items():
        assert task.name == name
        assert task.about.endswith(".")
        assert task.maps
