"""Who is started again, and who is not."""

import sys

import pytest

from scm.clock import NS_PER_S, StepClock, WallClock
from scm.runtime.supervisor import Job, Supervisor
from scm.v2x.messages.presence import Presence

CLOCK = WallClock()


def crew_of(role, code, said):
    def command():
        return [sys.executable, "-c", f"import time; time.sleep(0.2); raise SystemExit({code})"]

    return Supervisor([Job("x", role, "does it", command)], CLOCK, said.append)


def until_it_died(supervisor, said, *, up):
    supervisor.poll()
    if up:
        supervisor.receive(Presence(role="part", station="x", session="1", alive=True))
    supervisor.members["x"].process.wait(timeout=60.0)
    supervisor.poll()
    return said[-1]


@pytest.mark.parametrize("up", [True, False])
def test_a_part_that_finds_its_input_bad_at_the_start_alone_is_left_alone(up):
    said = []
    last = until_it_died(crew_of("part", 2, said), said, up=up)
    assert ("starts again" in last) == up
    assert ("its input is bad" in last) != up


def test_what_crashed_is_started_again_and_what_left_is_not():
    for code, words in ((1, "starts again"), (0, "left")):
        said = []
        assert words in until_it_died(crew_of("part", code, said), said, up=False)


def test_who_dies_again_and_again_comes_back_after_pauses_that_grow_to_half_a_minute():
    said, clock = [], StepClock(0)
    command = [sys.executable, "-c", "import signal; signal.raise_signal(signal.SIGKILL)"]
    supervisor = Supervisor([Job("record", "part", "records", lambda: command)], clock, said.append)
    pauses = []
    for _ in range(10):
        supervisor.poll()
        supervisor.members["record"].process.wait(timeout=60.0)
        supervisor.poll()
        clock.set_ns(supervisor.members["record"].due_ns)
        pauses.append(float(said[-1].split("again in ")[1].removesuffix(" s")))
    assert pauses == [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0, 30.0]
    assert "died by SIGKILL, 10 times in a row" in said[-1]
    assert supervisor.is_ready, "the others need not wait for it"
    supervisor.poll()
    supervisor.members["record"].process.wait(timeout=60.0)
    clock.set_ns(clock.now_ns() + 61 * NS_PER_S)
    supervisor.poll()
    assert said[-1].endswith("died by SIGKILL: starts again in 0.25 s"), "it had run for a minute"


def test_a_link_that_was_lost_for_a_moment_is_no_news():
    said = []
    supervisor = crew_of("part", 0, said)
    supervisor.poll()
    for alive in (True, False, True):
        supervisor.receive(Presence(role="part", station="x", session="1", alive=alive))
    supervisor.members["x"].process.wait(timeout=60.0)
    assert len(said) == 1
    assert "does it" in said[0]


def test_whose_start_takes_long_is_named_in_one_line_now_and_then():
    sleeps = [sys.executable, "-c", "import time; time.sleep(60)"]
    said, clock = [], StepClock()
    jobs = [Job(name, "part", "does it", lambda: sleeps) for name in ("world", "eye")]
    supervisor = Supervisor(jobs, clock, said.append)
    try:
        for at_s in (0, 3, 5, 15):
            clock.set_ns(at_s * NS_PER_S)
            supervisor.poll()
        assert len(said) == 1
        assert "5 s: still starting: world, eye; a first start compiles the physics" in said[0]
        supervisor.receive(Presence(role="part", station="world", session="1", alive=True))
        clock.set_ns(20 * NS_PER_S)
        supervisor.poll()
        assert said[-1].strip() == "20 s: still starting: eye"
    finally:
        for member in supervisor.members.values():
            member.process.kill()
            member.process.wait(timeout=60.0)
