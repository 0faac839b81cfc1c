"""Many worlds at once: each as if alone, begun anew by Gymnasium's rules, clear in its errors."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, Error, InvalidAction, ResetNeeded

import scm.gym
from scm.errors import CarError, MapError
from scm.geometry import Pose2
from scm.vehicles.fleet import Fleet

LAP = "driving_school/lap-v1"
STEPS, WORLDS = 260, 11  # more than a tile of the kernel
SEED = 10


def actions():
    """Return what each world does: most drive, and leave their lane sooner or later."""
    rng = np.random.default_rng(3)
    ahead = np.full((STEPS, WORLDS, 1), 0.4)
    return np.concatenate((ahead, rng.uniform(-0.6, 0.6, (STEPS, WORLDS, 1))), axis=2)


def played(first, count, **options):
    """Return what was seen, gained and ended in each step of some of the worlds."""
    envs = scm.gym.make_vec(LAP, count, **options)
    envs.worlds.task = replace(envs.worlds.task, lasts_s=5.0)
    seen, _ = envs.reset(seed=SEED + first)
    rows = [np.column_stack((seen, np.zeros((count, 3))))]
    for action in actions()[:, first : first + count]:
        seen, gain, ended, over, _ = envs.step(action)
        rows.append(np.column_stack((seen, gain, ended, over)))
    return np.array(rows)


@pytest.fixture(scope="module", params=["NextStep", "SameStep"])
def mode(request):
    return request.param


@pytest.fixture(scope="module")
def together(mode):
    return played(0, WORLDS, autoreset_mode=mode, randomise=1.0)


@pytest.mark.parametrize(("first", "count"), [(0, 1), (4, 3), (10, 1)])
def test_world_is_the_same_bit_by_bit_whatever_their_number(together, mode, first, count):
    ended, over = together[..., -2], together[..., -1]
    assert ended.sum() > WORLDS
    assert over.sum() > 3
    alone = played(first, count, autoreset_mode=mode, randomise=1.0)
    assert np.array_equal(alone, together[:, first : first + count])


def test_two_worlds_and_two_episodes_differ(together):
    begins = [together[0, world, :13] for world in range(WORLDS)]
    assert len({one.tobytes() for one in begins}) == WORLDS
    again = scm.gym.make_vec(LAP, 1)
    first, _ = again.reset(seed=SEED)
    second, _ = again.reset()
    assert not np.array_equal(first, second)
    assert np.array_equal(again.reset(seed=SEED)[0], first)


def test_episode_that_ended_begins_anew_in_the_next_step_without_reward():
    rows = played(0, WORLDS, autoreset_mode="NextStep")
    last = rows[:-1, :, -2:].any(axis=2)
    after = rows[1:][last]
    assert (after[:, -3:] == 0.0).all()
    assert np.abs(after[:, 1:6]).max() < 1e-15  # straight wheels, no action yet


def test_episode_that_ended_begins_anew_in_the_same_step_and_its_last_observation_is_given():
    envs = scm.gym.make_vec(LAP, WORLDS, autoreset_mode="SameStep")
    envs.reset(seed=SEED)
    for action in actions():
        seen, _, ended, _, infos = envs.step(action)
        if ended.any():
            break
    world = int(np.argmax(ended))
    assert infos["_final_obs"].tolist() == ended.tolist()
    assert infos["final_obs"][world][4] == np.float32(0.4)  # the action that ended it
    assert seen[world, 4] == 0.0
    assert [one is not None for one in infos["final_obs"]] == ended.tolist()


def test_world_that_ends_at_its_time_limit_is_terminated_and_not_truncated():
    def first_end(most):
        envs = scm.gym.make_vec(LAP, WORLDS, autoreset_mode="Disabled")
        envs.worlds.task = replace(envs.worlds.task, lasts_s=0.05 * most)
        envs.reset(seed=SEED)
        for step, action in enumerate(actions()[:most], 1):
            _, _, ended, over, _ = envs.step(action)
            if (ended | over).any():
                return step, ended, over
        raise AssertionError

    step, alone, _ = first_end(STEPS)
    _, ended, over = first_end(step)
    assert np.array_equal(ended, alone)
    assert np.array_equal(over, ~alone)


def test_world_that_ended_has_to_be_reset_where_nothing_resets_it():
    envs = scm.gym.make_vec(LAP, WORLDS, autoreset_mode="Disabled")
    before, _ = envs.reset(seed=SEED)
    for action in actions():
        seen, _, ended, _, _ = envs.step(action)
        if ended.any():
            break
    with pytest.raises(ResetNeeded, match=f"world {np.argmax(ended)} ended"):
        envs.step(action)
    after, _ = envs.reset(options={"reset_mask": ended})
    assert np.array_equal(after[~ended], seen[~ended])
    assert (after[ended, 4] == 0.0).all()
    assert not np.array_equal(after[ended], before[ended])
    envs.step(action)


def test_car_drives_as_the_physics_does():
    envs = scm.gym.make_vec(LAP, 2)
    envs.reset(seed=SEED)
    fleet = envs.worlds.fleet
    alone = Fleet(fleet.car, 1)
    alone.add(Pose2(*(float(v[1]) for v in (fleet.x, fleet.y, fleet.yaw))), float(fleet.speed[1]))
    for action in actions()[:20, :2]:
        seen, *_ = envs.step(action)
        alone.throttle[0], alone.steering[0] = action[1]
        alone.advance(0.05)
    assert seen[1, 0] == pytest.approx(alone.speed[0], abs=1e-7)
    assert (fleet.x[1], fleet.y[1]) == pytest.approx((alone.x[0], alone.y[0]), abs=1e-9)


def test_reward_is_the_way_less_what_it_cost():
    envs = scm.gym.make_vec(LAP, 3)
    seen, _ = envs.reset(seed=SEED)
    done = envs.worlds.course.known[:, 3].copy()
    seen, gain, ended, _, _ = envs.step(np.tile([0.5, 0.1], (3, 1)))
    assert not ended.any()
    way = envs.worlds.course.known[:, 3] - done
    half_lane = 0.5 * 0.257
    assert gain == pytest.approx(
        way - 0.002 * np.abs(seen[:, 6]) / half_lane - 0.01 * 0.1, abs=1e-6
    )
    assert (way > 0.0).all()


def test_observations_are_arrays_of_their_own_unless_views_are_requested():
    copies = scm.gym.make_vec(LAP, 2)
    first, _ = copies.reset(seed=1)
    before = first.copy()
    second = copies.step(np.ones((2, 2)))[0]
    assert np.array_equal(first, before)
    assert not np.shares_memory(first, second)
    views = scm.gym.make_vec(LAP, 2, copy=False)
    first, _ = views.reset(seed=1)
    assert np.shares_memory(first, views.step(np.ones((2, 2)))[0])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (np.zeros((3, 2)), r"shape \(3, 2\): expected \(2, 2\)"),
        ([[0.0, 0.0], [0.0, np.nan]], r"action of agent 1 is \[0.0, nan\]"),
    ],
)
def test_wrong_actions_are_refused_and_change_nothing(wrong, words):
    envs = scm.gym.make_vec(LAP, 2)
    envs.reset(seed=1)
    with pytest.raises(InvalidAction, match=words):
        envs.step(wrong)
    assert envs.worlds.steps.tolist() == [0, 0]


def test_use_before_reset_and_after_close_is_refused():
    envs = scm.gym.make_vec(LAP, 2)
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros((2, 2)))
    envs.close()
    with pytest.raises(ClosedEnvironmentError):
        envs.reset()
    with pytest.raises(ClosedEnvironmentError):
        envs.step(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lap", "expected a map, a task and its version"),
        ("driving_school/lab-v1", "did you mean 'lap'"),
        ("driving_school/lap-v9", "has version 1, not 9"),
    ],
)
def test_unknown_task_is_an_error_of_gymnasium_s_that_says_what_there_is(name, words):
    with pytest.raises(Error, match=words):
        scm.gym.make_vec(name)


def test_unknown_map_and_number_and_no_world_are_refused():
    with pytest.raises(Error, match="num_envs = 0: expected 1 or more"):
        scm.gym.make_vec(LAP, 0)
    with pytest.raises(MapError, match="atlantis"):
        scm.gym.make_vec("atlantis/lap-v1")
    with pytest.raises(CarError, match=r"steering\.trimm_rad.*steering\.trim_rad"):
        scm.gym.make_vec(LAP, ranges={"steering.trimm_rad": (0.0, 0.1)})


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"reset_mask": [True, False]}, TypeError, "expected an array of bool"),
        ({"reset_mask": np.zeros(2, bool)}, ValueError, "with an agent in it"),
        ({"reset_mask": np.ones(3, bool)}, ValueError, r"shape \(2,\)"),
    ],
)
def test_wrong_reset_mask_is_refused(options, error, words):
    envs = scm.gym.make_vec(LAP, 2)
    with pytest.raises(error, match=words):
        envs.reset(options=options)


def test_seeds_are_one_for_each_world():
    envs = scm.gym.make_vec(LAP, 2)
    both, _ = envs.reset(seed=[7, 5])
    assert np.array_equal(both[1], scm.gym.make_vec(LAP, 1).reset(seed=5)[0][0])
    with pytest.raises(ValueError, match="3 seeds: expected one for each of 2"):
        envs.reset(seed=[1, 2, 3])


def test_gymnasium_makes_the_same_one_world_and_many():
    one = gymnasium.make("scm/driving_school-lap-v1")
    many = gymnasium.make_vec("scm/driving_school-lap-v1", num_envs=3)
    seen, _ = many.reset(seed=SEED)
    assert np.array_equal(one.reset(seed=SEED + 2)[0], seen[2])
    one_step = one.step(np.array([0.5, 0.2], np.float32))
    all_steps = many.step(np.tile(np.array([0.5, 0.2], np.float32), (3, 1)))
    assert np.array_equal(one_step[0], all_steps[0][2])
    assert one_step[1] == all_steps[1][2]
