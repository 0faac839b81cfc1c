"""The published traversal of an intersection: four arms, straight on, six actions."""

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.error import InvalidAction

import scm.gym
from scm.gym.tasks.intersection import left_over

NAME = "intersection_school/intersection-v1"
STRAIGHT, SLOWLY = 4, 1
AHEAD = 2.35
WORLDS = 50


def begun(worlds=WORLDS, seed=1):
    envs = scm.gym.make_vec(NAME, 4 * worlds)
    return envs, envs.reset(seed=seed)[0]


def columns(envs, seen, *names):
    return seen[:, [envs.observation_names.index(name) for name in names]].T


def test_each_car_of_a_world_begins_in_another_arm_with_its_goal_straight_ahead():
    envs, seen = begun()
    fleet = envs.worlds.fleet
    dx, dy = columns(envs, seen, "goal_x_m", "goal_y_m")
    c, s = np.cos(fleet.yaw), np.sin(fleet.yaw)
    assert c * dx + s * dy == pytest.approx(AHEAD, abs=0.12)
    assert np.abs(c * dy - s * dx).max() < 0.1 + 0.05 * 2.45 + 0.01
    arms = np.round(fleet.yaw.reshape(WORLDS, 4) / (0.5 * np.pi)).astype(int) % 4
    assert (np.sort(arms, axis=1) == np.arange(4)).all()
    assert len({tuple(row) for row in arms.tolist()}) == 4  # which of them, is drawn
    assert np.array_equal((arms[:, 1] - arms[:, 0]) % 4, np.ones(WORLDS))  # counter-clockwise


def test_peers_are_seen_exactly_in_the_map_s_frame_and_far_away_when_they_are_out():
    envs, seen = begun(2)
    fleet = envs.worlds.fleet
    for _ in range(20):
        seen, *_ = envs.step(np.where(np.arange(8) == 5, STRAIGHT, SLOWLY))
    own, peer = 6, 5  # of its world the car before its own: the last
    x, y, turn, speed = columns(
        envs, seen, *(f"peer_2_{name}" for name in ("x_m", "y_m", "turn_rad", "speed_mps"))
    )
    assert x[own] == pytest.approx(fleet.x[peer] - fleet.x[own], abs=1e-6)
    assert y[own] == pytest.approx(fleet.y[peer] - fleet.y[own], abs=1e-6)
    expected = np.angle(np.exp(1j * (fleet.yaw[peer] - fleet.yaw[own])))
    assert turn[own] == pytest.approx(expected, abs=1e-6)
    assert abs(turn[own]) == pytest.approx(0.5 * np.pi, abs=0.11)
    assert speed[own] == pytest.approx(fleet.speed[peer], abs=1e-6)
    assert speed[own] > 1.5 * fleet.speed[own]
    envs.worlds.remove(np.arange(8) == peer)
    seen, *_ = envs.step(np.full(8, STRAIGHT))
    out = columns(
        envs, seen, *(f"peer_2_{name}" for name in ("x_m", "y_m", "turn_rad", "speed_mps"))
    )
    assert out[:, own].tolist() == [5.0, 5.0, 0.0, 0.0]
    assert out[0, 2] != 5.0  # the same car of the other world sees its own peers


def test_car_alone_arrives_after_the_published_way_and_gains_one():
    envs, _ = begun(1)
    worlds = envs.worlds
    worlds.remove(np.arange(4) != 0)
    away = worlds.to_goal.known[0, 4]
    for steps in range(1, 300):
        _, gain, ended, _, _ = envs.step(np.full(4, STRAIGHT))
        shaped = 0.01 / (0.001 + worlds.to_goal.known[0, 4])
        if ended[0]:
            break
        assert (gain[0], steps) == (pytest.approx(shaped), worlds.steps[0])
    assert gain[0] == pytest.approx(1.0 + shaped)
    assert worlds.to_goal.known[0, 4] == pytest.approx(0.26, abs=0.02)
    assert 0.05 * steps == pytest.approx((away - 0.26) / 0.267, abs=1.0)
    assert gain[1:].tolist() == [0.0] * 3
    worlds.touched[0] = True
    assert left_over(worlds)[0] == 0.0  # who touches another at the goal has arrived


def test_car_that_touches_the_line_between_the_directions_loses_by_what_was_left():
    envs, _ = begun(1)
    worlds = envs.worlds
    worlds.remove(np.arange(4) != 0)
    for _ in range(100):
        _, gain, ended, _, _ = envs.step(np.full(4, SLOWLY - 1))  # to the left
        if ended[0]:
            break
    away = worlds.to_goal.known[0, 4]
    assert away > 1.8
    assert gain[0] == pytest.approx(-0.425 * away + 0.01 / (0.001 + away))


def test_cars_that_all_drive_on_meet_in_the_middle():
    envs, _ = begun()
    good = np.zeros(4 * WORLDS, bool)
    done = good.copy()
    for _ in range(200):
        _, gain, ended, _, _ = envs.step(np.full(4 * WORLDS, STRAIGHT))
        good |= ended & (gain > 0.0) & ~done
        done |= ended
    assert done.all()
    assert 0.2 < good.mean() < 0.8


def test_actions_are_numbers_of_the_published_throttles_and_steerings():
    envs, _ = begun(1)
    assert envs.single_action_space == spaces.Discrete(6)
    envs.step(np.array([0, 2, 4, 5]))
    expected = [[0.5, 1.0], [0.5, -1.0], [1.0, 0.0], [1.0, -1.0]]
    assert envs.worlds.actions.tolist() == expected
    one = scm.gym.parallel_env(NAME)
    one.reset(seed=1)
    one.step(dict(zip(one.agents, [0, 2, np.int64(4), 5], strict=True)))
    assert one.worlds.actions.tolist() == expected


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ([0, 1, 6, 0], "action of agent 2 is 6: expected a whole number from 0 to 5"),
        ([0, -1, 0, 0], "action of agent 1 is -1"),
        ([0.0, 1.0, 2.0, 3.0], r"action of agent 0 is 0\.0: expected a whole number"),
        ([[0.5, 1.0]] * 4, r"actions of shape \(4, 2\): expected \(4,\)"),
    ],
)
def test_what_is_no_choice_is_refused_and_changes_nothing(wrong, words):
    envs, _ = begun(1)
    with pytest.raises(InvalidAction, match=words):
        envs.step(np.array(wrong))
    assert envs.worlds.steps.tolist() == [0]
