"""Actions: a speed and a curvature, which the controller of the city's cars follows."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import Error, InvalidAction
from gymnasium.utils.env_checker import check_env

import scm.gym
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import turning_radius_m

LAP = "driving_school/lap-v1"


def worlds_of(count=4, name=LAP, **options):
    worlds = scm.gym.make_vec(name, count, action="speed_curvature", **options).worlds
    worlds.seed(np.arange(count), np.arange(count))
    worlds.begin(np.ones(count, bool))
    return worlds


def driven(worlds, actions, seconds):
    """Let the cars drive on, over walls and all; return the last second's speeds and yaw rates."""
    found = []
    for _ in range(round(seconds / 0.05)):
        worlds.step(np.array(actions))
        found.append((worlds.fleet.speed.copy(), worlds.fleet.yaw_rate.copy()))
    return np.array(found[-20:]).mean(axis=0)


def test_car_drives_as_fast_as_chosen_forward_and_backward():
    chosen = np.array([0.08, 0.15, 0.24, -0.15])
    speed, _ = driven(worlds_of(), np.column_stack((chosen, np.zeros(4))), 5.0)
    assert speed == pytest.approx(chosen, abs=0.003)


def test_car_drives_a_circle_of_the_chosen_curvature():
    curvature = np.array([2.0, -2.0, 0.5, 1.0])
    actions = np.column_stack(([0.15, 0.15, 0.2, -0.1], curvature))
    speed, yaw_rate = driven(worlds_of(), actions, 5.0)
    assert yaw_rate / speed == pytest.approx(curvature, rel=0.03)


def test_car_stands_and_turns_round_when_the_sign_of_the_speed_changes():
    worlds = worlds_of()
    driven(worlds, [[0.2, 0.0]] * 4, 3.0)
    speed, _ = driven(worlds, [[-0.2, 0.0], [0.0, 0.0], [0.2, 0.0], [-0.1, 0.0]], 3.0)
    assert speed == pytest.approx([-0.2, 0.0, 0.2, -0.1], abs=0.004)


def test_heavier_car_is_brought_to_the_same_speed():
    worlds = worlds_of(ranges={"payload.mass_kg": (0.8, 0.8)})
    speed, _ = driven(worlds, [[0.15, 0.0]] * 4, 5.0)
    assert speed == pytest.approx(0.15, abs=0.003)


def test_bounds_are_what_the_car_reaches():
    space = scm.gym.make_vec(LAP, 2, action="speed_curvature").single_action_space
    most = load_car("nigel").vector("drive.throttle_speed_m_s")[-1]
    curvature = 1.0 / turning_radius_m(load_car("nigel"))
    assert space.high == pytest.approx([most, curvature], rel=0.01)
    assert space.low.tolist() == (-space.high).tolist()
    worlds = worlds_of(2)
    speed, yaw_rate = driven(worlds, [[9.0, 0.0], [0.1, 99.0]], 8.0)
    assert speed[0] == pytest.approx(most, rel=0.01)
    assert yaw_rate[1] / speed[1] == pytest.approx(curvature, rel=0.05)
    assert worlds.actions[[0, 1], [0, 1]] == pytest.approx(1.0)  # at its limits


def test_observed_action_is_the_command_in_force():
    envs = scm.gym.make_vec(LAP, 1, action="speed_curvature")
    envs.reset(seed=1)
    for _ in range(60):
        seen, *_ = envs.step(np.array([[0.2, 0.0]]))
    column = envs.observation_names.index("throttle")
    assert seen[0, column] == pytest.approx(0.735, abs=0.05)  # by the car file's table
    assert envs.worlds.action_names == ("speed_mps", "curvature_per_m")


def test_episode_begins_with_a_fresh_controller():
    worlds, other = worlds_of(1), worlds_of(1)
    driven(worlds, [[0.24, 1.0]], 2.0)
    for one in (worlds, other):
        one.seed(np.zeros(1, int), np.array([7]))
        one.begin(np.ones(1, bool))
    for _ in range(5):
        worlds.step(np.array([[0.2, 0.5]]))
        other.step(np.array([[0.2, 0.5]]))
        assert worlds.actions.tolist() == other.actions.tolist()


def test_world_is_the_same_bit_by_bit_whatever_their_number():
    drawn = np.random.default_rng(1).uniform(-1.0, 1.0, (120, 7, 2)) * (0.25, 3.0)
    seen = {}
    for first, count in ((0, 7), (3, 2)):
        envs = scm.gym.make_vec(LAP, count, action="speed_curvature", randomise=1.0)
        rows = [envs.reset(seed=40 + first)[0]]
        rows += [envs.step(one[first : first + count])[0] for one in drawn]
        seen[first] = np.array(rows)
    np.testing.assert_array_equal(seen[0][:, 3:5], seen[3])


@pytest.mark.parametrize("name", ["scm/driving_school-lap-v1", "scm/parking_lot-parking-v1"])
def test_gymnasium_finds_nothing_wrong(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", r".*recommend using a symmetric and normalized space")
        env = gymnasium.make(name, action="speed_curvature").unwrapped
        env.action_space.seed(1)
        check_env(env)


def test_several_agents_choose_speeds_too():
    env = scm.gym.parallel_env("market_town/crossing-v1", action="speed_curvature")
    env.reset(seed=1)
    space = env.action_space("car_0")
    assert space.high[0] == pytest.approx(0.267, abs=0.003)
    for _ in range(20):
        env.step(dict.fromkeys(env.agents, np.array([0.2, 0.0])))
    assert env.worlds.fleet.speed == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize(
    ("name", "action", "words"),
    [
        (LAP, "speed", "action = 'speed': expected throttle_steering or speed_curvature"),
        ("intersection_school/intersection-v1", "speed_curvature", "intersection are choices"),
        ("market_town/signal_control-v1", "speed_curvature", "signal_control are choices"),
    ],
)
def test_kind_of_action_that_there_is_not(name, action, words):
    with pytest.raises(Error, match=words):
        scm.gym.make_vec(name, 4, action=action)


def test_wrong_values_are_refused_and_nothing_is_stepped():
    envs = scm.gym.make_vec(LAP, 2, action="speed_curvature")
    envs.reset(seed=1)
    before = envs.worlds.fleet.x.copy()
    with pytest.raises(InvalidAction, match=r"agent 1 .*nan.*two numbers, -0\.26\d* to 0\.26"):
        envs.step(np.array([[0.1, 0.0], [np.nan, 0.0]]))
    with pytest.raises(InvalidAction, match=r"shape \(2,\): expected \(2, 2\)"):
        envs.step(np.zeros(2))
    assert envs.worlds.fleet.x.tolist() == before.tolist()
