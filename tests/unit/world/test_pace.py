"""Simulated time follows the clock; what it cannot follow is counted and shown."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.world.pace import Every, Pace

PERIOD = 20 * NS_PER_MS


def paced(*ticks_ms):
    pace = Pace(PERIOD)
    return pace, [pace.steps(t * NS_PER_MS) for t in ticks_ms]


def test_a_tick_of_twenty_milliseconds_makes_four_contact_steps():
    assert paced(0, 20, 40)[1] == [0, 4, 4]


def test_what_is_left_of_a_tick_is_made_up_in_the_next():
    assert paced(0, 22, 44, 65)[1] == [0, 4, 4, 5]


def test_a_tick_longer_than_the_longest_is_cut_and_the_rest_counted_as_lost():
    pace, steps = paced(0, 250)
    assert steps == [0, 20]
    assert pace.lost_ns == 150 * NS_PER_MS


def test_lost_time_shows_in_the_real_time_factor():
    pace, _ = paced(0, 200)
    assert pace.real_time_factor == pytest.approx(0.5)


def test_the_real_time_factor_forgets_what_is_older_than_a_second():
    pace, _ = paced(0, 500, *range(520, 2000, 20))
    assert pace.real_time_factor == pytest.approx(1.0)


def test_only_a_tick_much_later_than_its_period_is_late():
    pace, _ = paced(0, 20, 45, 80)
    assert pace.late_ticks == 1


def test_a_clock_that_stands_still_makes_no_steps():
    assert paced(10, 10)[1] == [0, 0]


def test_something_due_at_seven_hertz_happens_seven_times_a_second():
    due = Every(7.0)
    assert sum(due.is_due(t) for t in range(0, 10 * NS_PER_S, PERIOD)) == 70


def test_a_long_gap_is_not_made_up_by_a_burst():
    due = Every(50.0)
    due.is_due(0)
    assert [due.is_due(t) for t in (NS_PER_S, NS_PER_S + 1)] == [True, False]
