"""Several agents in one world: whose episode ends is taken away, and the others drive on."""

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, InvalidAction, ResetNeeded

import scm.gym

CROSSING = "driving_school/crossing-v1"
ROUND_M = 6.92


def begun(seed=1):
    env = scm.gym.parallel_env(CROSSING)
    return env, env.reset(seed=seed)[0]


def actions(env, seen, off=()):
    """Return actions that follow the lanes; of some agents, ones that leave them."""
    found = {}
    for agent in env.agents:
        lane = dict(zip(env.observation_names, seen[agent].astype(float), strict=True))
        steering = 1.7 * lane["lane_turn_0.2m_rad"] - 8.0 * lane["beside_m"]
        steering = 1.0 if agent in off else steering - 2.0 * lane["turned_rad"]
        found[agent] = np.array([0.6, np.clip(steering, -1.0, 1.0)])
    return found


def test_cars_begin_spread_over_the_lanes():
    env, seen = begun()
    names = env.observation_names
    places = [(0.0, 0.0)] + [
        (seen["car_0"][names.index(f"other_{k}_ahead_m")],
         seen["car_0"][names.index(f"other_{k}_left_m")]) for k in range(3)
    ]  # fmt: skip
    gaps = [np.hypot(*np.subtract(a, b)) for a in places for b in places if a is not b]
    assert min(gaps) > 0.35
    course = env.worlds.course
    alone = scm.gym.parallel_env(CROSSING).worlds.course
    assert alone is not course
    states = course.arrays[1]
    at = [*zip(states.lane_window[:, 1].tolist(), states.floats[:, 0].tolist(), strict=True)]
    lengths = course.arrays[0].length
    along = sorted(sum(lengths[:lane].tolist()) + s for lane, s in at)
    assert np.diff([*along, along[0] + ROUND_M]) == pytest.approx(ROUND_M / 4, abs=0.02)


def test_car_that_left_its_lane_is_gone_and_the_others_drive_on():
    env, seen = begun()
    for _ in range(200):
        seen, gained, ended, over, _ = env.step(actions(env, seen, off=("car_2",)))
        if any(ended.values()):
            break
    assert [agent for agent, is_over in ended.items() if is_over] == ["car_2"]
    assert not any(over.values())
    assert gained["car_2"] < -0.9
    assert env.agents == ["car_0", "car_1", "car_3"]

    worlds, here = env.worlds, env.worlds.fleet.pose(2)
    names = env.observation_names
    seen, gained, _, _, infos = env.step(actions(env, seen))
    assert set(seen) == set(gained) == set(infos) == {"car_0", "car_1", "car_3"}
    assert worlds.rewards()[2] == 0.0
    assert not worlds.ends()[2]
    assert worlds.fleet.pose(2) == here
    assert seen["car_0"][names.index("other_1_age_s")] == pytest.approx(0.05)
    assert seen["car_0"][names.index("other_0_age_s")] == 0.0
    motion = worlds.fleet.planar_cogs(np.arange(4))
    motion[0] = motion[2]  # it drives through where that one was
    found = worlds._touching.find(motion, present=worlds.present)
    assert found.tolist() == [False, False, False, False]
    assert env.reset()[0].keys() == set(env.possible_agents)
    assert worlds.present.all()


def test_who_leaves_the_lane_at_the_time_limit_is_terminated_and_not_truncated():
    def ends_at(most):
        env, seen = begun()
        env.worlds.task = env.worlds.task.__class__(**{
            name: most * 0.05 if name == "lasts_s" else getattr(env.worlds.task, name)
            for name in env.worlds.task.__slots__
        })  # fmt: skip
        for step in range(1, most + 1):
            seen, _, ended, over, _ = env.step(actions(env, seen, off=("car_2",)))
            if any(ended.values()) or any(over.values()):
                return step, ended, over
        return most, {}, {}

    step, _, _ = ends_at(200)
    same, ended, over = ends_at(step)
    assert same == step
    assert (ended["car_2"], over["car_2"]) == (True, False)
    assert (ended["car_0"], over["car_0"]) == (False, True)


def test_wrong_use_is_refused():
    env = scm.gym.parallel_env(CROSSING)
    with pytest.raises(ResetNeeded):
        env.step({})
    _, seen = env, env.reset(seed=1)[0]
    given = actions(env, seen)
    with pytest.raises(InvalidAction, match="no action of car_3: expected one of each of car_0"):
        env.step({name: one for name, one in given.items() if name != "car_3"})
    with pytest.raises(InvalidAction, match=r"action of agent car_1 is \[nan, 0.0\]"):
        env.step(given | {"car_1": np.array([np.nan, 0.0])})
    assert env.worlds.steps.tolist() == [0]
    env.close()
    with pytest.raises(ClosedEnvironmentError):
        env.reset()
