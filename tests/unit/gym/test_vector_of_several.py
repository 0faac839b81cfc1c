"""Many worlds of several agents: each agent a row, out until its whole world begins anew."""

from dataclasses import replace

import numpy as np
import pytest
from gymnasium.error import Error, ResetNeeded

import scm.gym

CROSSING = "driving_school/crossing-v1"
AGENTS, WORLDS, STEPS, SEED = 4, 5, 200, 20
ROWS = AGENTS * WORLDS
LASTS_S = 4.0


def actions(step):
    """Return what each agent does: most drive and leave their lane sooner or later."""
    rng = np.random.default_rng(step)
    return np.column_stack((np.full(ROWS, 0.5), rng.uniform(-0.3, 0.9, ROWS)))


def begun(mode="NextStep", worlds=WORLDS, seed=SEED):
    envs = scm.gym.make_vec(CROSSING, AGENTS * worlds, autoreset_mode=mode)
    envs.worlds.task = replace(envs.worlds.task, lasts_s=LASTS_S)
    return envs, *envs.reset(seed=seed)


def by_world(values):
    return values.reshape(WORLDS, AGENTS)


def test_agent_that_is_out_reports_its_end_once_and_gains_nothing_until_its_world_begins_anew():
    envs, _, infos = begun()
    present = infos["present"]
    assert present.all()
    begins = 0
    for step in range(STEPS):
        _, gain, ended, over, infos = envs.step(actions(step))
        done = ended | over
        assert not (ended & over).any()
        assert not done[~present].any()
        assert (gain[~present] == 0.0).all()
        are_out = ~by_world(present).any(axis=1)
        after = by_world(infos["present"])
        assert after[are_out].all()
        expected = by_world(present & ~done)
        assert np.array_equal(after[~are_out], expected[~are_out])
        begins += are_out.sum()
        present = infos["present"]
    assert begins > WORLDS


def test_world_is_the_same_bit_by_bit_as_the_parallel_environment_of_its_seed():
    envs, seen, _ = begun()
    one = scm.gym.parallel_env(CROSSING)
    one.worlds.task = replace(one.worlds.task, lasts_s=LASTS_S)
    world, names = 3, one.possible_agents
    rows = slice(world * AGENTS, (world + 1) * AGENTS)
    alone, _ = one.reset(seed=SEED + world)
    episodes = ends = 0
    for step in range(STEPS):
        present = [name in one.agents for name in names]
        own = seen[rows]
        for row, name in enumerate(names):
            assert not present[row] or np.array_equal(own[row], alone[name])
        given = actions(step)
        seen, gain, ended, over, infos = envs.step(given)
        if not one.agents:
            alone, _ = one.reset()
            episodes += 1
            continue
        agents = {name: given[rows][row] for row, name in enumerate(names) if present[row]}
        alone, gained, out, late, _ = one.step(agents)
        for row, name in enumerate(names):
            if present[row]:
                found = (gain[rows][row], ended[rows][row], over[rows][row])
                assert found == (gained[name], out[name], late[name])
                ends += out[name] or late[name]
        assert infos["present"][rows].tolist() == [name in one.agents for name in names]
    assert episodes > 1
    assert ends > AGENTS


def test_same_step_gives_last_observations_of_each_end_and_begins_when_all_are_out():
    envs, seen, _ = begun("SameStep")
    next_step, _, _ = begun("NextStep")
    begins = alone = 0
    compared = True
    for step in range(STEPS):
        seen, _, ended, over, infos = envs.step(actions(step))
        done = ended | over
        assert by_world(infos["present"]).any(axis=1).all()
        if done.any():
            assert infos["_final_obs"].tolist() == done.tolist()
            assert [one is not None for one in infos["final_obs"]] == done.tolist()
            began = by_world(done).any(axis=1) & by_world(infos["present"]).all(axis=1)
            begins += began.sum()
            alone += (done & ~np.repeat(began, AGENTS)).sum()
            for row in np.flatnonzero(done & np.repeat(began, AGENTS)):
                assert infos["final_obs"][row][4] == np.float32(0.5)  # the action that ended it
                assert seen[row, 4] == 0.0
        else:
            assert "final_obs" not in infos
        if compared:
            last, _, same, late, _ = next_step.step(actions(step))
            assert np.array_equal(ended, same)
            assert np.array_equal(over, late)
            for row in np.flatnonzero(done):
                assert np.array_equal(infos["final_obs"][row], last[row])
            compared = by_world(next_step.worlds.present).any(axis=1).all()
    assert begins > WORLDS
    assert alone > AGENTS


def test_disabled_goes_on_with_who_is_left_and_refuses_a_world_that_is_over():
    envs, _, _ = begun("Disabled")
    present = np.ones(ROWS, bool)
    for step in range(STEPS):
        seen, _, ended, over, infos = envs.step(actions(step))
        present &= ~(ended | over)
        assert np.array_equal(infos["present"], present)
        are_out = ~by_world(present).any(axis=1)
        if are_out.any():
            break
    assert not are_out.all()
    assert (present != np.repeat(~are_out, AGENTS)).any()  # others are out, too, and went on
    with pytest.raises(ResetNeeded, match=f"world {np.argmax(are_out)} ended"):
        envs.step(actions(0))
    mask = np.repeat(are_out, AGENTS)
    with pytest.raises(ValueError, match=f"all agents of world {np.argmax(are_out)}, or none"):
        envs.reset(options={"reset_mask": mask & (np.arange(ROWS) % AGENTS != 1)})
    after, infos = envs.reset(options={"reset_mask": mask})
    assert np.array_equal(infos["present"], present | mask)
    assert np.array_equal(after[~mask], seen[~mask])
    envs.step(actions(1))


def test_seeds_are_one_for_each_world():
    _, both, _ = begun(worlds=2, seed=[7, 5])
    _, alone, _ = begun(worlds=1, seed=5)
    assert np.array_equal(both[AGENTS:], alone)


def test_number_of_agents_makes_whole_worlds():
    with pytest.raises(Error, match="num_envs = 6: expected a multiple of 4, the agents of a"):
        scm.gym.make_vec(CROSSING, 6)
    assert scm.gym.make_vec(CROSSING, 8).worlds.count == 2
