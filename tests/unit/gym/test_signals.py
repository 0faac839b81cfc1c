"""What cars see of the lights of their world, and who passes at red."""

from dataclasses import replace

import numpy as np
import pytest

import scm.gym

GREEN_LIGHT = "driving_school/green_light-v1"
PERIOD_S = 0.05
CYCLE_S = 20.0  # two stages of 8 s, each with a second of yellow and one of all red


def along_the_lane(names, values):
    """Return actions that follow the lanes at a constant throttle."""
    lane = dict(zip(names, values.T.astype(float), strict=True))
    steering = 1.7 * lane["lane_turn_0.2m_rad"]
    steering += -8.0 * lane["beside_m"] - 2.0 * lane["turned_rad"]
    return np.column_stack((np.full(len(values), 0.8), np.clip(steering, -1.0, 1.0)))


@pytest.fixture(scope="module")
def seen():
    """Return what eight worlds saw in a minute, their cars driving along their lanes."""
    envs = scm.gym.make_vec(GREEN_LIGHT, 8)
    envs.worlds.task = replace(envs.worlds.task, ends=())
    names = envs.observation_names
    values, _ = envs.reset(seed=5)
    rows, passed = [values], []
    for _ in range(1150):
        values, *_ = envs.step(along_the_lane(names, values))
        rows.append(values)
        passed.append(envs.worlds.signals.known[:, 3].copy())
    columns = [names.index(name) for name in ("stop_line_m", "signal_is_green", "signal_change_s")]
    return np.array(rows)[:, :, columns], np.array(passed), envs


def test_line_comes_nearer_as_the_car_drives_and_is_then_the_next(seen):
    lines, _, _ = seen
    way = -np.diff(lines[:, :, 0], axis=0)
    assert np.abs(way[(way > -0.02) & (way < 0.05)]).max() < 0.02  # 0.27 m/s
    jumps = way < -1.0
    assert 20 < jumps.sum() < 60  # twice a round of 6.92 m
    assert lines[:-1, :, 0][jumps].max() < 0.02


def test_lights_change_when_they_say_and_have_their_cycle(seen):
    lines, _, envs = seen
    same = np.abs(np.diff(lines[:, :, 0], axis=0)) < 0.5
    passed_s = -np.diff(lines[:, :, 2], axis=0)
    counts = same & (lines[1:, :, 2] > PERIOD_S) & (lines[:-1, :, 2] > PERIOD_S)
    assert passed_s[counts] == pytest.approx(PERIOD_S, abs=1e-4)
    assert lines[:, :, 2].max() <= CYCLE_S - 8.0
    assert (lines[:, :, 2][lines[:, :, 1] > 0.5]).max() <= 8.0
    assert lines[:, :, 1][lines[:, :, 0] < 2.9].mean() == pytest.approx(0.4, abs=0.08)
    assert len(set(envs.worlds.signals._shares.tolist())) == 8


def test_who_passes_while_neither_green_nor_yellow_shows_has_passed_red(seen):
    lines, passed, _ = seen
    crossed = np.diff(lines[:, :, 0], axis=0) > 1.0
    green = lines[:-1, :, 1] > 0.5
    assert not passed[~crossed].any()
    assert not passed[crossed & green & (lines[:-1, :, 2] > PERIOD_S)].any()
    red = crossed & ~green & (lines[:-1, :, 2] < CYCLE_S - 8.0 - 1.2)  # yellow is over
    assert red.sum() > 5
    assert passed[red & (lines[:-1, :, 2] > PERIOD_S)].all()
    yellow = crossed & ~green & (lines[:-1, :, 2] > CYCLE_S - 8.0 - 0.9)
    assert yellow.any()
    assert not passed[yellow].any()


def test_episode_ends_at_red():
    envs = scm.gym.make_vec(GREEN_LIGHT, 64, autoreset_mode="Disabled")
    names = envs.observation_names
    values, _ = envs.reset(seed=2)
    for _ in range(400):
        values, _, ended, *_ = envs.step(along_the_lane(names, values))
        if ended.any():
            break
    assert (envs.worlds.signals.known[ended, 3] == 1.0).all()
