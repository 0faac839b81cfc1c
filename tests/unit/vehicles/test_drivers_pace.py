"""Speeds and throttle."""

import pytest

from scm.clock import NS_PER_MS
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.pace import Pace, free_speeds, stopping_speed
from scm.vehicles.drivers.track import Track

TABLE = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175, speeds=(0.1, 0.2, 0.3, 0.4))
BARE = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175)


def settled(pace, wished, speed, ticks=100):
    """Return the throttle after a while at one speed."""
    value = 0.0
    for tick in range(ticks):
        value = pace.throttle(wished, speed, tick * 20 * NS_PER_MS)
    return value


def test_the_steady_throttle_is_that_of_the_table():
    assert settled(Pace(TABLE), 0.25, 0.25) == pytest.approx(0.625)


@pytest.mark.parametrize("limits", [TABLE, BARE])
def test_a_car_too_slow_gets_more_throttle_and_one_too_fast_less(limits):
    wished = 0.25
    slow, right, fast = (settled(Pace(limits), wished, wished + d) for d in (-0.05, 0.0, 0.05))
    assert slow > right > fast or slow > fast == 0.0


def test_a_standing_car_is_held_until_it_may_really_go():
    pace = Pace(TABLE)
    assert pace.throttle(0.03, 0.0, 0) == 0.0
    assert pace.throttle(0.05, 0.0, 20 * NS_PER_MS) > 0.0


def test_a_wish_of_zero_is_no_throttle_at_once():
    pace = Pace(TABLE)
    settled(pace, 0.25, 0.25)
    assert pace.throttle(0.0, 0.25, 10**10) == 0.0


def test_a_start_is_not_faster_than_comfortable():
    pace = Pace(TABLE)
    first = pace.throttle(0.4, 0.0, 0)
    assert first < 0.5


def test_without_a_table_the_throttle_grows_until_the_car_moves():
    pace = Pace(BARE)
    assert settled(pace, 0.25, 0.0, ticks=10) < settled(pace, 0.25, 0.0, ticks=200)


@pytest.mark.parametrize("distance", [0.0, 0.01, 0.1, 1.0])
def test_the_stopping_speed_needs_no_more_than_the_deceleration_given(distance):
    step = 1e-4
    v, ahead = stopping_speed(distance + step, 0.5), stopping_speed(distance, 0.5)
    assert v * (v - ahead) / step <= 0.5 + 1e-9


def test_at_the_end_the_stopping_speed_is_zero():
    assert stopping_speed(0.0, 0.5) == 0.0
    assert stopping_speed(-1.0, 0.5) == 0.0


def test_curves_and_lanes_limit_the_speed_and_braking_for_them_starts_before():
    roads = Roads(load_map("driving_school"))
    track = Track(Path.circulation(roads, "east_loop"))
    assert max(free_speeds(track, TABLE)) == pytest.approx(0.25)
    slow = CarLimits(0.14, 0.52, 0.42, 0.23, 0.07, 0.175, lateral_accel=0.02, decel=0.05)
    speeds = free_speeds(track, slow)
    assert min(speeds) == pytest.approx((0.02 * 0.5145) ** 0.5, rel=0.03)
    steps = [(b**2 - a**2) / 2.0 / track.s[1] for a, b in zip(speeds[1:], speeds, strict=False)]
    assert max(steps) <= 0.05 + 1e-6
