"""Clocks: anchored once, monotonic, and one that moves only when told to."""

import threading

import pytest

from scm.clock import (
    NS_PER_MS,
    NS_PER_S,
    ProcessorClock,
    StepClock,
    WallClock,
    nanoseconds,
    seconds,
)


def test_spans_convert_both_ways():
    assert nanoseconds(1.5) == 1_500_000_000
    assert seconds(NS_PER_MS) == 0.001
    assert nanoseconds(seconds(123_456_789)) == 123_456_789


def test_half_a_nanosecond_is_rounded_not_cut():
    assert nanoseconds(0.1 + 0.2) == 300_000_000


def test_a_wall_clock_tells_the_epoch():
    year_2020_ns = 1_577_836_800 * NS_PER_S
    assert WallClock().now_ns() > year_2020_ns


def test_a_wall_clock_never_goes_back():
    clock = WallClock()
    times = [clock.now_ns() for _ in range(1000)]
    assert times == sorted(times)


def test_a_step_of_the_systems_time_does_not_move_a_wall_clock(monkeypatch):
    clock = WallClock()
    before_ns = clock.now_ns()
    monkeypatch.setattr("time.time_ns", lambda: 0)
    assert 0 <= clock.now_ns() - before_ns < 3600 * NS_PER_S  # it would be decades


def test_a_wall_clock_waits_until_its_time():
    clock = WallClock()
    until_ns = clock.now_ns() + 20 * NS_PER_MS
    assert clock.wait_until(until_ns, threading.Event()) is False
    assert clock.now_ns() >= until_ns


def test_a_wall_clock_is_woken_early():
    clock, wake = WallClock(), threading.Event()
    wake.set()
    began_ns = clock.now_ns()
    assert clock.wait_until(began_ns + 60 * NS_PER_S, wake) is True
    assert clock.now_ns() - began_ns < 30 * NS_PER_S


def test_a_time_that_has_passed_is_not_waited_for():
    clock = WallClock()
    assert clock.wait_until(clock.now_ns() - NS_PER_S, threading.Event()) is False


def test_a_processor_clock_counts_work_and_no_waiting():
    clock, wake = ProcessorClock(), threading.Event()
    began_ns = clock.now_ns()
    while clock.now_ns() < began_ns + 20 * NS_PER_MS:
        pass
    assert clock.wait_until(clock.now_ns() + 60 * NS_PER_S, wake) is False
    wake.set()
    assert clock.wait_until(0, wake) is True


def test_a_step_clock_stands_still():
    clock = StepClock(5)
    assert clock.now_ns() == clock.now_ns() == 5


def test_a_step_clock_moves_when_told_to():
    clock = StepClock()
    clock.set_ns(7)
    assert clock.now_ns() == 7


def test_a_step_clock_refuses_to_go_back():
    clock = StepClock(5)
    with pytest.raises(ValueError, match="now 5 ns, asked for 4 ns"):
        clock.set_ns(4)


def test_waiting_on_a_step_clock_takes_it_there_at_once():
    clock = StepClock()
    assert clock.wait_until(60 * NS_PER_S, threading.Event()) is False
    assert clock.now_ns() == 60 * NS_PER_S


def test_waiting_for_the_past_leaves_a_step_clock_where_it_is():
    clock = StepClock(5)
    clock.wait_until(3, threading.Event())
    assert clock.now_ns() == 5
