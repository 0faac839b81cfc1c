"""Trials of a city in lockstep: what they measure of a frozen controller, and when they refuse."""

import signal

import pytest

from scm.clock import NS_PER_MS, NS_PER_S, nanoseconds
from scm.errors import RunError
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Subscription
from scm.selftest.signals import SignalTrials
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.spat import Spat

CITY = load_map("driving_school")
LOOK_S = 0.01
WARM_S = 12.0


class Freezing(BasePart):
    """A controller whose process can be stopped and continued."""

    def __init__(self):
        self._real = TrafficPart(CITY, "brisk")
        self.name, self.role, self.period_ns = "traffic", "part", self._real.period_ns
        self.subscriptions, self.services = self._real.subscriptions, self._real.services
        self._is_frozen, self._waits = False, []

    def send(self, number):
        self._is_frozen = number == signal.SIGSTOP

    def step(self, now_ns, inbox):
        self._waits += inbox
        if self._is_frozen:
            return []
        waits, self._waits = self._waits, []
        return self._real.step(now_ns, waits)

    def finish(self, now_ns):
        return self._real.finish(now_ns)


class LockstepObserver:
    """What an observer offers, in a city's own time; `late_s`: how long verdicts take."""

    def __init__(self, city, late_s=0.0):
        self.clock, self._city, self._late_ns = city.clock, city, nanoseconds(late_s)
        self._boxes = {kind: city.subscribe(Subscription(kind)) for kind in (Spat, MonitorStatus)}
        self._all = {kind: [] for kind in self._boxes}

    def received(self, kind, since_ns=0):
        self._all[kind] += self._boxes[kind].drain()
        late_ns = self._late_ns if kind is MonitorStatus else 0
        came = [(item.t_ns + late_ns, item.message) for item in self._all[kind]]
        return [one for one in came if since_ns <= one[0] <= self.clock.now_ns()]

    def first_ns(self, kind, since_ns, of):
        return next((t_ns for t_ns, message in self.received(kind, since_ns) if of(message)), None)

    def listen(self, span_s):
        self._city.run_for(span_s)

    def wait(self, until, timeout_s):
        end_ns = self.clock.now_ns() + nanoseconds(timeout_s)
        while not until():
            if self.clock.now_ns() >= end_ns:
                return False
            self.listen(LOOK_S)
        return True

    def request(self, request):
        return self._city.call(request)

    def went_ns(self, junction):
        return 0


@pytest.fixture
def traffic():
    return Freezing()


@pytest.fixture
def city(traffic):
    with Lockstep([traffic, MonitorPart(CITY)]) as running:
        running.run_for(WARM_S)
        yield running


def frozen(city, traffic, late_s=0.0):
    trials = SignalTrials(CITY, LockstepObserver(city, late_s), lambda: None, traffic.send)
    (outcome,) = trials.run(["frozen_controller"])
    return outcome


def test_a_frozen_controller_is_found_whenever_it_freezes_and_goes_on(city, traffic):
    for part_of_a_step in range(10):
        city.run_for(0.1 + 0.013 * part_of_a_step)
        outcome = frozen(city, traffic)
        assert (outcome.reported, outcome.ok) == ("stale", True)
        assert 450 * NS_PER_MS < outcome.flash_ns <= NS_PER_S


def test_signals_that_do_not_run_are_not_tested(city, traffic):
    traffic.send(signal.SIGSTOP)
    with pytest.raises(RunError, match="crossing: got no steady signals within 30 s"):
        frozen(city, traffic)


def test_an_observer_that_receives_old_verdicts_begins_no_trial(city, traffic):
    assert frozen(city, traffic, late_s=0.05).ok
    with pytest.raises(RunError, match="no steady signals"):
        frozen(city, traffic, late_s=2.0)
