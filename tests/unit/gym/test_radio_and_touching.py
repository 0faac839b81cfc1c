"""What cars of one world know of each other, and which of them touch something."""

import numpy as np
import pytest
from msgspec.structs import replace

from scm.gym.radio import AGE, AHEAD, COS_TURN, LEFT, NEVER_S, SIN_TURN, SPEED, Radio
from scm.gym.touching import Touching
from scm.maps.load import load_map
from scm.records.city_map import RadioChannel
from scm.vehicles.car import load_car
from scm.vehicles.noise import bases_of

MAP = load_map("driving_school")
MOTION = np.array([[1.0, 0.5, 0.5 * np.pi, 0.2], [0.8, 0.9, 0.0, 0.1], [1.5, 0.5, 0.0, 0.0]] * 2)
EVERY = np.arange(6)
KEYS = bases_of(np.full(6, 3, np.uint64), EVERY)


def known(radio, step=0, present=None):
    radio.exchange(
        EVERY, MOTION, np.full(6, 0.05 * step), np.full(6, step), KEYS,
        np.ones(6, bool) if present is None else present,
    )  # fmt: skip
    return radio.known.copy()


def test_others_are_seen_from_the_own_car():
    radio = Radio(MAP, 2, 3)
    radio.forget(EVERY)
    seen = known(radio)[0, 0]
    assert seen[[AHEAD, LEFT, SPEED, AGE]] == pytest.approx([0.4, 0.2, 0.1, 0.0])
    assert seen[[COS_TURN, SIN_TURN]] == pytest.approx([0.0, -1.0], abs=1e-12)
    assert known(radio)[0, 1, LEFT] == pytest.approx(-0.5)
    assert np.array_equal(known(radio)[:3], known(radio)[3:])  # its own world's alone


def test_frames_are_lost_as_the_channel_says_and_age_until_the_next():
    radio = Radio(replace(MAP, radio=RadioChannel(loss=0.7)), 2, 3)
    radio.forget(EVERY)
    assert radio.known[..., AGE].max() == 0.0
    ages = np.array([known(radio, step)[..., AGE] for step in range(400)])
    came = ages == 0.0
    assert came.mean() == pytest.approx(0.3, abs=0.03)
    assert np.diff(ages, axis=0)[~came[1:] & (ages[1:] < NEVER_S)] == pytest.approx(0.05)
    assert (ages[0][~came[0]] == NEVER_S).all()
    assert not np.array_equal(came[:, :3], came[:, 3:])  # each episode has its own losses


def test_who_is_out_sends_nothing():
    radio = Radio(MAP, 2, 3)
    radio.forget(EVERY)
    present = np.array([True, False, True] * 2)
    assert known(radio, present=present)[0, :, AGE].tolist() == [NEVER_S, 0.0]


def motion(*poses):
    return np.array([[*pose, 0.0, 0.0, 0.0] for pose in poses])


def test_cars_touch_walls_and_others_of_their_own_world_only():
    car = load_car("nigel")
    touching = Touching(MAP, car, np.arange(4).reshape(2, 2), 2)
    free, near, wall = (1.0, 0.6, 0.0), (1.2, 0.65, 0.0), (2.75, 0.6, 0.0)
    every = np.ones(4, bool)
    assert touching.find(motion(free, wall, near, near), present=every).tolist() == [
        False, True, True, True,
    ]  # fmt: skip
    assert not touching.find(
        motion(free, (2.0, 0.6, 0.0), near, (2.0, 0.7, 0.0)), present=every
    ).any()
    gone = np.array([True, True, True, False])
    assert not touching.find(motion(free, (2.0, 0.6, 0.0), near, near), present=gone).any()
