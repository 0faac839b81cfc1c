"""Stations as real processes on a real router: how they die, and who notices how fast."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from scm.clock import NS_PER_S, WallClock, seconds
from scm.runtime.supervisor import Job, Supervisor
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.presence import Presence
from scm.v2x.router import Router, free_endpoint

pytestmark = pytest.mark.e2e
TOY = str(Path(__file__).with_name("toy_station.py"))
CLOCK = WallClock()
NEVER = threading.Event()
LONG_S = 20.0


class Watch:
    """A listener at the router that remembers who came and went, and when."""

    def __init__(self, endpoint):
        self.bus = ZenohBus("city", "watch", endpoint)
        self.seen, self.events = [], []
        self._presence, self._words = Mailbox(1000), Mailbox(1000)
        self.bus.subscribe(Presence, {}, self._presence)
        self.bus.subscribe(CityEvent, {}, self._words)

    def look(self):
        self.seen += self._presence.drain()
        self.events += [item.message for item in self._words.drain()]

    def alive(self, name):
        self.look()
        states = [i.message.alive for i in self.seen if i.message.station == name]
        return bool(states) and states[-1]

    def told(self, name):
        self.look()
        return [event.text for event in self.events if event.name == name]


@pytest.fixture
def watch():
    with Router(free_endpoint()) as router:
        watch = Watch(router.listen)
        watch.endpoint = router.listen
        with watch.bus:
            yield watch


@pytest.fixture
def start(watch):
    processes = []

    def start(name, behaviour="run"):
        command = [sys.executable, TOY, name, watch.endpoint, behaviour]
        process = subprocess.Popen(command, stderr=subprocess.PIPE)
        processes.append(process)
        return process

    yield start
    for process in processes:
        if process.poll() is None:
            os.kill(process.pid, signal.SIGCONT)
            process.kill()
        process.wait()
        process.stderr.close()


def until(condition, timeout_s=LONG_S, also=lambda: None):
    """Wait for a condition; return how long it took [s]."""
    began_ns = CLOCK.now_ns()
    while not condition():
        also()
        assert seconds(CLOCK.now_ns() - began_ns) < timeout_s, "it did not happen in time"
        NEVER.wait(0.01)
    return seconds(CLOCK.now_ns() - began_ns)


def test_a_process_that_dies_of_an_exception_with_an_open_bus_is_gone_within_two_seconds(
    watch, start
):
    process = start("leaky", "leak")
    until(lambda: watch.alive("leaky") or process.poll() is not None)
    process.wait(timeout=2.0)
    assert process.returncode == 1
    assert b"nobody closes this bus" in process.stderr.read()
    until(lambda: not watch.alive("leaky"), 1.5)


def test_a_part_that_fails_tells_the_city_and_its_process_ends(watch, start):
    process = start("toy", "fail")
    until(lambda: watch.told("part_failed") == ["toy stopped: RuntimeError: toy broke"])
    process.wait(timeout=2.0)
    assert process.returncode == 1


def test_a_process_that_is_killed_is_missed_within_a_second_and_a_half(watch, start):
    process = start("toy")
    until(lambda: watch.alive("toy"))
    process.kill()
    until(lambda: not watch.alive("toy"), 1.5)


def test_a_process_that_is_frozen_is_missed_when_its_lease_ends_and_found_when_it_goes_on(
    watch, start
):
    process = start("toy")
    until(lambda: watch.alive("toy"))
    os.kill(process.pid, signal.SIGSTOP)
    assert until(lambda: not watch.alive("toy"), 4.0) > 0.3
    os.kill(process.pid, signal.SIGCONT)
    until(lambda: watch.alive("toy"), 5.0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_part_that_is_asked_to_stop_says_its_last_words_and_ends(watch, start, number):
    process = start("toy")
    until(lambda: watch.alive("toy"))
    process.send_signal(number)
    process.wait(timeout=2.0)
    assert process.returncode == 0
    until(lambda: watch.told("bye") == ["bye"], 2.0)


class Supervised:
    """A supervisor of toys."""

    def __init__(self, watch, clock, **behaviours):
        self.said = []
        jobs = [
            Job(name, "part", f"a toy to {how}", self._command(watch, name, how))
            for name, how in behaviours.items()
        ]
        self.supervisor = Supervisor(jobs, clock, self.said.append)
        self._presence = Mailbox(100)
        watch.bus.subscribe(Presence, {}, self._presence)

    @staticmethod
    def _command(watch, name, how):
        return lambda: [sys.executable, TOY, name, watch.endpoint, how]

    def look(self):
        self.supervisor.poll()
        for item in self._presence.drain():
            self.supervisor.receive(item.message)

    def until(self, condition, timeout_s=LONG_S):
        return until(condition, timeout_s, also=self.look)

    def pids(self):
        return [m.process.pid for m in self.supervisor.members.values() if m.process is not None]


@pytest.fixture
def supervise(watch):
    started = []

    def supervise(clock=CLOCK, **behaviours):
        started.append(Supervised(watch, clock, **behaviours))
        return started[-1]

    yield supervise
    for supervised in started:
        supervised.supervisor.stop()


def is_running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_the_supervisor_says_who_is_up_with_what_it_does_and_its_process(supervise):
    toys = supervise(a="run", b="run")
    toys.until(lambda: toys.supervisor.is_ready)
    assert sorted(line.split()[0] for line in toys.said) == ["a", "b"]
    assert all("a toy to run" in line and "pid" in line for line in toys.said)


def test_the_supervisor_restarts_what_dies_and_says_so(supervise):
    toys = supervise(a="run")
    toys.until(lambda: toys.supervisor.is_ready)
    (first,) = toys.pids()
    os.kill(first, signal.SIGKILL)
    toys.until(lambda: any("is back" in line for line in toys.said))
    assert toys.pids() != [first]
    assert any("died by SIGKILL: starts again in 0.25 s" in line for line in toys.said)
    assert not any("is silent" in line for line in toys.said)


def test_the_supervisor_says_who_is_frozen_and_who_goes_on(supervise):
    toys = supervise(a="run")
    toys.until(lambda: toys.supervisor.is_ready)
    (pid,) = toys.pids()
    os.kill(pid, signal.SIGSTOP)
    toys.until(lambda: any("is silent: it runs" in line for line in toys.said))
    os.kill(pid, signal.SIGCONT)
    toys.until(lambda: any("is back" in line for line in toys.said))
    assert toys.pids() == [pid]


def test_the_supervisor_gives_up_on_bad_input_at_once(supervise):
    toys = supervise(a="exit2")
    toys.until(lambda: toys.supervisor.is_ready)
    assert toys.said == [
        "  a            died with exit code 2: its input is bad; it is not started again"
    ]


def test_a_member_that_leaves_by_itself_is_let_go(supervise):
    toys = supervise(a="exit0")
    toys.until(lambda: toys.supervisor.is_ready)
    assert toys.said == ["  a            left"]


def test_the_supervisor_is_stopped_within_two_seconds_even_if_one_does_not_listen(supervise):
    toys = supervise(a="run", b="deaf", c="run")
    toys.until(lambda: toys.supervisor.is_ready)
    pids = toys.pids()
    began_ns = CLOCK.now_ns()
    toys.supervisor.stop()
    assert CLOCK.now_ns() - began_ns < 2 * NS_PER_S
    assert len(pids) == 3
    assert not any(is_running(pid) for pid in pids)
    assert toys.said[-1] == "  b            did not stop: killed"


SUPERVISOR = """
import sys, threading
from scm.clock import WallClock
from scm.runtime.supervisor import Job, Supervisor
toy, endpoint = sys.argv[1:]
command = [sys.executable, toy, "orphan", endpoint]
Supervisor([Job("orphan", "part", "", lambda: command)], WallClock(), print).poll()
threading.Event().wait()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's parent watch is Linux's")
def test_children_die_with_a_supervisor_that_is_killed(watch):
    command = [sys.executable, "-c", SUPERVISOR, TOY, watch.endpoint]
    with subprocess.Popen(command) as supervisor:
        until(lambda: watch.alive("orphan"))
        supervisor.kill()
    until(lambda: not watch.alive("orphan"), 2.0)


def test_a_router_watches_and_writes_to_its_links_with_one_thread():
    endpoint = free_endpoint()
    with subprocess.Popen([sys.executable, "-m", "scm.selftest.router", endpoint]) as router:
        try:
            ZenohBus("city", "guest", endpoint, connect_timeout_s=LONG_S).close()
            threads = Path(f"/proc/{router.pid}/task").glob("*/comm")
            names = {thread.read_text().strip() for thread in threads}
        finally:
            router.kill()
    assert "tx-0" in names
    assert "acc-0" not in names
