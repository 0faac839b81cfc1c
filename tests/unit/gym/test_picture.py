"""A world from above shows its cars where they are."""

import gymnasium
import numpy as np
import pytest

import scm.gym
from scm.errors import LearningError
from scm.gym.picture import AGENT, FIRST, GOAL, GREEN, OUT, RED, RULED, Picture
from scm.gym.policy_file import write_policy

LAP = "scm/driving_school-lap-v1"


def seen_at(env, picture, x, y):
    """Return the colour at a place of the floor, blue, green, red."""
    floor = env.worlds.city_map.floor
    height, width = picture.shape[:2]
    per_m = (max(height, width) - 2) / max(np.ptp(floor.x_m), np.ptp(floor.y_m))
    row, column = round((floor.y_m[1] - y) * per_m), round((x - floor.x_m[0]) * per_m)
    return tuple(picture[row, column, ::-1].tolist())


def colours_of_cars(env, picture, world=0):
    fleet = env.worlds.fleet
    rows = env.worlds.cars[world]
    return [seen_at(env, picture, fleet.x[row], fleet.y[row]) for row in rows]


def test_each_car_has_its_paint_where_it_is():
    envs = scm.gym.make_vec("driving_school/traffic-v1", 2, render_mode="rgb_array")
    envs.reset(seed=1)
    for world, picture in enumerate(envs.render()):
        assert colours_of_cars(envs, picture, world) == [FIRST, RULED, RULED, RULED]


def test_cars_that_are_out_are_dark():
    envs = scm.gym.make_vec("market_town/crossing-v1", 4, render_mode="rgb_array")
    envs.reset(seed=1)
    envs.worlds.remove(np.array([False, True, False, False]))
    assert colours_of_cars(envs, envs.render()[0]) == [FIRST, OUT, AGENT, AGENT]


def test_goal_is_shown():
    envs = scm.gym.make_vec("parking_school/parking-v1", 1, render_mode="rgb_array")
    envs.reset(seed=1)
    x, y, _ = envs.worlds.way.goals[0]
    assert seen_at(envs, envs.render()[0], x, y) == GOAL


def test_lines_are_as_junctions_choose():
    envs = scm.gym.make_vec("market_town/signal_control-v1", 2)
    envs.reset(seed=1)
    picture = Picture(envs.worlds)
    for is_green, colour in ((False, RED), (True, GREEN)):
        envs.worlds.junctions.green[:] = is_green
        shown = picture.of()[:, :, ::-1].reshape(-1, 3)
        assert (shown == colour).all(axis=1).sum() > 100
    assert set(colours_of_cars(envs, picture.of())) == {RULED}


def test_gymnasium_makes_an_environment_with_pictures():
    env = gymnasium.make(LAP, render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    assert (before.dtype, before.shape[2], env.metadata["render_fps"]) == (np.uint8, 3, 20.0)
    env.step(np.array([1.0, 0.0]))
    env.step(np.array([1.0, 0.0]))
    assert (env.render() != before).any()


def test_world_of_several_agents_has_pictures():
    env = scm.gym.parallel_env("market_town/crossing-v1", render_mode="rgb_array")
    env.reset(seed=1)
    assert colours_of_cars(env, env.render()) == [FIRST, AGENT, AGENT, AGENT]


def test_without_render_mode_there_is_no_picture():
    env = scm.gym.CityEnv(LAP)
    env.reset(seed=1)
    assert env.render() is None
    assert scm.gym.parallel_env("market_town/crossing-v1").render() is None


def test_unknown_render_mode_is_refused():
    with pytest.raises(gymnasium.error.Error, match="'human': expected rgb_array or None"):
        scm.gym.make_vec(LAP, 1, render_mode="human")


def test_policy_of_choices_by_number_cannot_be_written(tmp_path):
    envs = scm.gym.make_vec("intersection_school/intersection-v1", 4)
    count = len(envs.observation_names)
    layer = np.zeros((count, 2)), np.zeros(2)
    with pytest.raises(LearningError, match="its actions are choices"):
        write_policy(tmp_path / "it.onnx", [layer], np.zeros(count), np.ones(count), envs)
