"""A policy that needs no training: a linear law that follows its lane."""

import numpy as np
import pytest

import scm.gym
from scm.gym.policy_file import write_policy


@pytest.fixture(scope="module")
def envs():
    return scm.gym.make_vec("driving_school/lap-v1", 4)


@pytest.fixture(scope="module")
def policy(envs, tmp_path_factory):
    """Return the file of a policy of one layer."""
    path = tmp_path_factory.mktemp("policy") / "lane.onnx"
    names = envs.observation_names
    weights = np.zeros((len(names), 2))
    for name, gain in {"beside_m": -8.0, "turned_rad": -2.0, "lane_turn_0.2m_rad": 1.7}.items():
        weights[names.index(name), 1] = gain
    columns = np.zeros(len(names)), np.ones(len(names))
    write_policy(path, [(weights, np.array([0.8, 0.0]))], *columns, envs)
    return path
