"""The bar of a diagnosis grows and names what is tried; where no terminal is, lines stay plain."""

import io

import pytest

from scm.clock import StepClock
from scm.mismatch.progress import Progress

STEPS = (
    "checking the data", "fitting the car's own numbers", "trying 46 effects from 155 starts",
    "refitting payload, drag ...", "trying 46 effects from 151 starts", "refitting drag ...",
    "computing what a push at each moment would explain",
    "screening 52 effects outside the catalogue",
    "refitting 17 effects outside the catalogue, such as drive force",
    "judging on what the fit did not see", "designing the drive that would decide",
    "writing the report",
)  # fmt: skip


class Terminal(io.StringIO):
    def isatty(self):
        return True


def share(line):
    return int(line.split("]")[1].split("%")[0])


@pytest.fixture
def clock():
    return StepClock()


def test_the_share_grows_from_step_to_step_and_between_them(clock):
    progress, seen = Progress(Terminal(), clock), []
    for text in STEPS:
        progress.notify(text)
        seen.append(share(progress.line()))
        clock.set_ns(clock.now_ns() + 20_000_000_000)
        seen.append(share(progress.line()))
    progress.close()
    assert seen == sorted(seen)
    assert seen[0] == 0
    assert 95 <= seen[-1] <= 100


def test_the_bar_shows_what_is_tried_and_for_how_long(clock):
    stream = Terminal()
    progress = Progress(stream, clock)
    clock.set_ns(7_000_000_000)
    progress.notify("trying 46 effects from 155 starts")
    progress.close()
    drawn = stream.getvalue()
    assert "[" in drawn
    assert "7 s  trying 46 effects" in drawn
    assert drawn.endswith("\r\033[K")


def test_elsewhere_each_step_is_a_plain_line(clock):
    stream = io.StringIO()
    progress = Progress(stream, clock)
    progress.notify("checking the data")
    progress.close()
    assert stream.getvalue() == "    0 s    0 %  checking the data\n"


def test_of_several_cars_each_takes_its_share_and_is_named(clock):
    progress, seen = Progress(Terminal(), clock), []
    for number, name in enumerate(("n1", "n2", "all cars")):
        progress.turn(name, number, 3)
        for text in STEPS:
            progress.notify(text)
            seen.append(share(progress.line()))
        assert f"{name}: writing" in progress.line()
    progress.close()
    assert seen == sorted(seen)
    assert seen[len(STEPS)] == 33
    assert seen[-1] >= 95
