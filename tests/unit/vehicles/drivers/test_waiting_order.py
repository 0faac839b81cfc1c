"""In which order cars at the lines of a junction go."""

import numpy as np
import pytest

from scm.clock import NS_PER_S
from scm.vehicles.drivers.driver_state import NEVER_NS
from scm.vehicles.drivers.waiting_order import (
    LONG_WAIT_NS,
    TURN_EVERY_NS,
    TURN_NS,
    TURN_SHIFT_NS,
    has_turn,
    is_earlier,
    note_standing,
)


class Station:
    """One station and its CAMs."""

    def __init__(self):
        self.stood, self.at = np.full(1, NEVER_NS, np.int64), np.zeros((1, 2))

    def send(self, t_s, x, speed):
        cams = np.array([[x, 0.0, 0.0, speed, 0.0]])
        note_standing(self.stood, self.at, np.array([0]), round(t_s * NS_PER_S), cams)
        return int(self.stood[0])


def test_a_car_waits_since_its_first_cam_at_standstill():
    station = Station()
    assert station.send(1.0, 4.0, 0.2) == NEVER_NS
    assert station.send(2.0, 4.3, 0.01) == 2 * NS_PER_S
    assert station.send(3.0, 4.3, 0.0) == 2 * NS_PER_S


def test_who_starts_and_stops_again_keeps_its_place():
    station = Station()
    station.send(2.0, 4.3, 0.0)
    assert station.send(3.0, 4.33, 0.06) == 2 * NS_PER_S
    assert station.send(4.0, 4.35, 0.0) == 2 * NS_PER_S


def test_a_car_that_moves_up_in_a_queue_restarts_its_wait():
    station = Station()
    station.send(2.0, 4.3, 0.0)
    assert station.send(3.0, 4.5, 0.1) == NEVER_NS
    assert station.send(4.0, 4.7, 0.0) == 4 * NS_PER_S


@pytest.mark.parametrize("order", [0, 3])
def test_a_turn_comes_after_long_ends_and_comes_again(order):
    def at(age_ns):
        return has_turn(5, order, 5 + age_ns)

    again = LONG_WAIT_NS + TURN_EVERY_NS + order * TURN_SHIFT_NS
    assert [at(LONG_WAIT_NS - 1), at(LONG_WAIT_NS), at(LONG_WAIT_NS + TURN_NS)] == [
        False,
        True,
        False,
    ]
    assert [at(again - 1), at(again), at(again + TURN_NS)] == [False, True, False]
    assert not has_turn(NEVER_NS, order, 5)


def test_of_two_that_stand_just_one_is_earlier():
    for mine, theirs in ((3, 4), (4, 3), (4, 4)):
        assert is_earlier(theirs, 1, mine, 0) != is_earlier(mine, 0, theirs, 1)
    assert is_earlier(4, 0, 4, 1)
    assert not is_earlier(NEVER_NS, 0, NEVER_NS, 1)
    assert is_earlier(4, 1, NEVER_NS, 0)
