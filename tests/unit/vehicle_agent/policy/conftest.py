"""A policy that needs no training: a linear law that follows its lane."""

import numpy as np
import pytest

import scm.gym
from scm.gym.policy_file import write_policy


@pytest.fixture(scope="module")
def envs():
    return scm.gym.make_vec("driving_school/lap-v1", 4)


def lane_policy(path, envs, drive, beside, turned, bend):
    """Write a policy of one layer: a constant, and gains on where the car is in its lane."""
    names = envs.observation_names
    weights = np.zeros((len(names), 2))
    gains = {"beside_m": beside, "turned_rad": turned, "lane_turn_0.2m_rad": bend}
    for name, gain in gains.items():
        weights[names.index(name), 1] = gain
    columns = np.zeros(len(names)), np.ones(len(names))
    write_policy(path, [(weights, np.array([drive, 0.0]))], *columns, envs)
    return path


@pytest.fixture(scope="module")
def policy(envs, tmp_path_factory):
    """Return the file of a policy of throttle and steering."""
    path = tmp_path_factory.mktemp("policy") / "lane.onnx"
    return lane_policy(path, envs, 0.8, beside=-8.0, turned=-2.0, bend=1.7)


@pytest.fixture(scope="module")
def cruising(tmp_path_factory):
    """Return environments, and the file of a policy that chooses 0.15 m/s and its lane's bend."""
    envs = scm.gym.make_vec("driving_school/lap-v1", 4, action="speed_curvature")
    path = tmp_path_factory.mktemp("cruising") / "lane.onnx"
    return envs, lane_policy(path, envs, 0.15, beside=-33.0, turned=-8.0, bend=5.0)
