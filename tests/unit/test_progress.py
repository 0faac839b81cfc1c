"""Long work says how far it is, with and without a terminal."""

import io
from contextlib import closing

import pytest

from scm import progress
from scm.clock import StepClock
from scm.progress import Progress
from tests.e2e.city_process import wait_for


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_step_is_shown_at_once_with_how_many_are_done():
    stream, clock = io.StringIO(), StepClock()
    with closing(Progress(stream, clock)) as work:
        work.step("making cases", 0, 8)
        clock.set_ns(34_000_000_000)
        work.step("making cases", 4, 8)  # a count alone may change many times a second
        work.step("diagnosing", 2, 8)
    assert stream.getvalue().splitlines() == [
        "    0 s  making cases [........................] 0 of 8",
        "   34 s  diagnosing [######..................] 2 of 8",
    ]


@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_work_that_takes_long_goes_on_saying_so(kind, monkeypatch):
    monkeypatch.setattr(progress, "REPEATED_S", 0.01)
    monkeypatch.setattr(progress, "REDRAWN_S", 0.01)
    stream, clock = kind(), StepClock()
    with closing(Progress(stream, clock)) as work:
        work.step("diagnosing", 0, 1)
        clock.set_ns(20_000_000_000)
        wait_for(lambda: "20 s  diagnosing" in stream.getvalue(), 30.0, "it says so again")
    assert stream.getvalue().endswith(progress.CLEARED) == (kind is Terminal)


def test_work_that_never_began_leaves_nothing():
    stream = Terminal()
    Progress(stream, StepClock()).close()
    assert stream.getvalue() == ""
