"""Speeds and throttle."""

import numpy as np
import pytest

from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.driver_state import kind_row
from scm.vehicles.drivers.lane_graph import LaneGraph
from scm.vehicles.drivers.speed_control import free_speed, stopping_speed, throttle

TABLE = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175, speeds=(0.1, 0.2, 0.3, 0.4))
BARE = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175)
TICK_S = 0.02


class Pedal:
    """The throttle law of one car, with what it remembers."""

    def __init__(self, limits):
        self.kind, self.floats, self.passed = kind_row(limits, 0.3), np.zeros(8), -1.0

    def press(self, wished, speed, ticks=1):
        for _ in range(ticks):
            value = throttle(self.kind, self.floats, wished, speed, self.passed)
            self.passed = TICK_S
        return value


def test_the_steady_throttle_is_that_of_the_table():
    assert Pedal(TABLE).press(0.25, 0.25, 100) == pytest.approx(0.625)


@pytest.mark.parametrize("limits", [TABLE, BARE])
def test_a_car_too_slow_gets_more_throttle_and_one_too_fast_less(limits):
    wished = 0.25
    slow, right, fast = (
        Pedal(limits).press(wished, wished + off, 100) for off in (-0.05, 0.0, 0.05)
    )
    assert slow > right > fast or slow > fast == 0.0


def test_a_standing_car_is_held_until_it_may_really_go():
    pedal = Pedal(TABLE)
    assert pedal.press(0.03, 0.0) == 0.0
    assert pedal.press(0.05, 0.0) > 0.0


def test_a_target_of_zero_cuts_the_throttle_immediately():
    pedal = Pedal(TABLE)
    pedal.press(0.25, 0.25, 100)
    assert pedal.press(0.0, 0.25) == 0.0


def test_a_start_is_not_faster_than_comfortable():
    assert Pedal(TABLE).press(0.4, 0.0) < 0.5


def test_without_a_table_the_throttle_grows_until_the_car_moves():
    assert Pedal(BARE).press(0.25, 0.0, 10) < Pedal(BARE).press(0.25, 0.0, 200)


def test_a_table_longer_than_the_law_holds_means_the_same_speeds():
    fine = CarLimits(
        0.14, 0.52, 0.42, 0.23, 0.07, 0.175, speeds=tuple(0.4 * k / 64 for k in range(1, 65))
    )
    assert Pedal(fine).press(0.25, 0.25, 100) == pytest.approx(0.625)


@pytest.mark.parametrize("distance", [0.0, 0.01, 0.1, 1.0])
def test_the_stopping_speed_needs_no_more_than_the_deceleration_given(distance):
    step = 1e-4
    v, ahead = stopping_speed(distance + step, 0.5), stopping_speed(distance, 0.5)
    assert v * (v - ahead) / step <= 0.5 + 1e-9


def test_at_the_end_the_stopping_speed_is_zero():
    assert stopping_speed(0.0, 0.5) == 0.0
    assert stopping_speed(-1.0, 0.5) == 0.0


@pytest.fixture
def eight():
    """Return segments of the eight: a straight, the east loop, and what comes after it."""
    ways = LaneGraph(Roads(load_map("driving_school"))).arrays
    ids = np.array([1, 2, 3, 4], np.int64)
    return ways, ids, np.cumsum([0.0, *ways.segments[ids, 1]])


def speeds_along(eight, limits):
    ways, ids, begins = eight
    places = np.arange(0.0, begins[2], 0.02)
    found = []
    for s in places:
        here = int(np.searchsorted(begins, s, side="right")) - 1
        found.append(
            free_speed(ways.segments, ids, begins - s, 4, here, limits.lateral_accel, limits.decel)
        )
    return places, np.array(found)


def test_the_lane_limits_the_speed(eight):
    assert speeds_along(eight, TABLE)[1].max() == pytest.approx(0.25)


def test_curves_limit_the_speed_and_braking_for_them_starts_before(eight):
    slow = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175, lateral_accel=0.02, decel=0.05)
    places, speeds = speeds_along(eight, slow)
    assert speeds.min() == pytest.approx((0.02 * 0.5145) ** 0.5, rel=0.03)
    assert speeds[0] > speeds.min()
    braking = -np.diff(speeds**2) / 2.0 / np.diff(places)
    assert braking.max() <= 0.05 + 1e-6
