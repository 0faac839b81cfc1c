"""Pursuit: one car follows another at close distance, wherever that drives."""

import numpy as np
import pytest

import scm.gym
from scm.geometry import Pose2
from scm.gym import ends, rewards
from scm.gym.observations import Observations

PURSUIT = "driving_school/pursuit-v1"


def begun(count, name=PURSUIT):
    worlds = scm.gym.make_vec(name, count).worlds
    worlds.seed(np.arange(count), np.arange(count))
    worlds.begin(np.ones(count, bool))
    return worlds


def put_agent(worlds, off):
    """Put the agent's car of the first world relative to the pursued one."""
    pose = worlds.fleet.pose(worlds.count) @ off
    worlds.fleet.place_rows(np.zeros(1, int), np.array([[*pose]]), np.zeros(1))


def test_pursued_car_begins_ahead():
    seen = Observations(worlds := begun(50), ["pursued"]).update()
    away = np.hypot(seen[:, 0], seen[:, 1])
    assert (seen[:, 0] > 0.3).all()
    assert 0.4 < away.min() < 0.6
    assert 0.85 < away.max() <= 1.0 + 0.02
    assert seen[:, 4] == pytest.approx(worlds.fleet.speed[50:], abs=1e-6)


def test_pursued_car_is_seen_from_the_own():
    worlds = begun(1)
    off = Pose2(-0.6, 0.2, 0.3)
    put_agent(worlds, off)
    seen, there = Observations(worlds, ["pursued"]).update()[0], off.inverse()
    assert seen[:2] == pytest.approx([there.x, there.y], abs=1e-6)
    assert seen[2:4] == pytest.approx([np.cos(0.3), -np.sin(0.3)], abs=1e-6)


@pytest.mark.parametrize(
    ("away", "close", "too_far", "lost"),
    [
        (0.35, 0.0, 0.0, False),
        (0.45, 1.0, 0.0, False),
        (0.65, 1.0, 0.0, False),
        (0.9, 0.0, 0.2, False),
        (2.1, 0.0, 1.4, True),
    ],
)
def test_what_is_close_too_far_and_lost(away, close, too_far, lost):
    worlds = begun(1)
    put_agent(worlds, Pose2(-away, 0.0, 0.0))
    assert rewards.close(worlds)[0] == close
    assert rewards.too_far(worlds)[0] == pytest.approx(too_far, abs=1e-9)
    assert ends.lost(worlds)[0] == lost


@pytest.mark.parametrize("name", [PURSUIT, "market_town/pursuit-v1"])
def test_car_that_steers_towards_the_other_and_holds_its_distance_stays_close(name):
    envs = scm.gym.make_vec(name, 40, autoreset_mode="Disabled")
    seen, _ = envs.reset(seed=1)
    column = {one: k for k, one in enumerate(envs.observation_names)}
    close, ended = [], np.zeros(40, bool)
    for _ in range(700):
        ahead, left, speed = (
            seen[:, column[f"pursued_{one}"]] for one in ("ahead_m", "left_m", "speed_mps")
        )
        away = np.hypot(ahead, left)
        # a circle through the other car, of the curvature 2 left / away^2
        steering = np.arctan(0.1415 * 2.0 * left / away**2) / 0.5236
        throttle = (speed + 1.0 * (away - 0.55)) / 0.26
        envs.worlds.step(np.column_stack((throttle, steering)))
        ended |= envs.worlds.ends()
        seen = envs._seen.update()
        close.append(rewards.close(envs.worlds))
    assert not ended.any()
    assert np.mean(close[100:]) > 0.9


def test_car_that_stands_loses_the_other():
    worlds, over = begun(10, "market_town/pursuit-v1"), np.zeros(10, bool)
    for _ in range(700):
        worlds.step(np.zeros((10, 2)))
        over |= ends.lost(worlds)
        assert not worlds.touched.any()
    assert over.all()


def test_contact_with_the_pursued_car_ends_the_episode():
    worlds = begun(1)
    put_agent(worlds, Pose2(-0.28, 0.0, 0.0))
    worlds.step(np.zeros((1, 2)))
    assert worlds.ends().all()
