"""The live runner: deadlines, lateness, vital signs, last words, failures."""

import threading

import pytest

from scm.clock import NS_PER_MS, NS_PER_S, StepClock
from scm.runtime.live import run
from scm.runtime.part import BasePart, Subscription
from scm.v2x.bus import Mailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence


class City:
    """A memory bus on a stepped clock, and somebody who listens to one class of messages."""

    def __init__(self):
        self.clock = StepClock(NS_PER_S)
        self.network = MemoryNetwork(self.clock)
        self.stop = threading.Event()
        self._listener = self.network.bus("city", "listener")

    def subscribe(self, kind):
        mailbox = Mailbox(1000)
        self._listener.subscribe(kind, {}, mailbox)
        return mailbox

    def run(self, part, **options):
        run(part, self.network.bus("city", part.name), self.clock, self.stop, **options)


class Stepping(BasePart):
    """A part that takes `costs_ms` for its steps in turn and stops the run after `steps`."""

    name, role = "stepping", "part"
    period_ns = 20 * NS_PER_MS
    subscriptions, services = (), ()

    def __init__(self, city, steps, costs_ms=()):
        self.city = city
        self.left = steps
        self.costs_ms = list(costs_ms)
        self.began = []

    def step(self, now_ns, inbox):
        self.began.append((now_ns - NS_PER_S) // NS_PER_MS)
        if self.costs_ms:
            cost_ns = round(self.costs_ms.pop(0) * NS_PER_MS)
            self.city.clock.set_ns(self.city.clock.now_ns() + cost_ns)
        self.left -= 1
        if not self.left:
            self.city.stop.set()
        return []

    def finish(self, now_ns):
        return [CityEvent(severity="info", source=self.name, t_ns=now_ns, name="bye", text="bye")]


@pytest.fixture
def city():
    return City()


def messages(mailbox):
    return [item.message for item in mailbox.drain()]


def test_steps_keep_to_absolute_deadlines_whatever_they_cost(city):
    part = Stepping(city, 5, costs_ms=[3, 17, 0, 19, 1])
    city.run(part)
    assert part.began == [0, 20, 40, 60, 80]


def test_many_of_a_kind_step_together_at_beats_of_the_clock(city):
    city.clock.set_ns(NS_PER_S + 3 * NS_PER_MS)
    part = Stepping(city, 4, costs_ms=[1, 25])
    city.run(part, on_tick=True)
    assert part.began == [25, 45, 70, 85]


def test_a_step_that_overruns_coalesces_the_ones_it_covered(city):
    part = Stepping(city, 4, costs_ms=[0, 75, 0, 0])
    city.run(part)
    assert part.began == [0, 20, 95, 100]


def test_steps_that_were_late_by_a_period_or_more_are_counted(city):
    statuses = city.subscribe(PartStatus)
    city.run(Stepping(city, 60, costs_ms=[0, 75]))
    assert messages(statuses)[0].late_steps == 2


def test_a_step_less_than_a_period_late_is_not_counted(city):
    statuses = city.subscribe(PartStatus)
    part = Stepping(city, 60, costs_ms=[0, 39])
    city.run(part)
    assert part.began[:4] == [0, 20, 59, 60]
    assert messages(statuses)[0].late_steps == 0


def test_vital_signs_go_out_once_a_second(city):
    statuses = city.subscribe(PartStatus)
    city.run(Stepping(city, 151, costs_ms=[0, 5.5]))
    told = messages(statuses)
    assert [s.t_ns // NS_PER_S for s in told] == [2, 3, 4]
    assert [s.step_ms for s in told] == [5.5, 0.0, 0.0]


def test_a_parts_own_status_goes_out_with_its_vital_signs_filled_in(city):
    class Telling(Stepping):
        def step(self, now_ns, inbox):
            super().step(now_ns, inbox)
            if len(self.began) != 10:
                return []
            return [PartStatus(station=self.name, t_ns=now_ns, detail="6 cars")]

    statuses = city.subscribe(PartStatus)
    city.run(Telling(city, 40, costs_ms=[2]))
    (status,) = messages(statuses)
    assert (status.detail, status.step_ms) == ("6 cars", 2.0)


def test_what_a_part_hears_is_in_its_inbox(city):
    class Hearing(Stepping):
        subscriptions = (Subscription(CityEvent, {"source": "talker"}),)

        def step(self, now_ns, inbox):
            self.heard = [item.message.name for item in inbox]
            return super().step(now_ns, inbox)

    talker = city.network.bus("city", "talker")
    for name in ("one", "two"):
        talker.publish(
            CityEvent(severity="info", source="talker", t_ns=0, name=name, text="a sentence")
        )
    part = Hearing(city, 1)
    city.run(part)
    assert part.heard == ["one", "two"]


def test_last_words_are_said_before_the_part_leaves(city):
    words, presence = city.subscribe(CityEvent), city.subscribe(Presence)
    city.run(Stepping(city, 1))
    assert [m.name for m in messages(words)] == ["bye"]
    assert [m.alive for m in messages(presence)] == [True, False]


def test_a_part_that_fails_is_told_to_the_city_and_raised(city, caplog):
    class Failing(Stepping):
        def step(self, now_ns, inbox):
            msg = "the wheel came off"
            raise ValueError(msg)

    words, presence = city.subscribe(CityEvent), city.subscribe(Presence)
    with pytest.raises(ValueError, match="wheel"):
        city.run(Failing(city, 1))
    (told,) = messages(words)
    assert (told.severity, told.name) == ("error", "part_failed")
    assert "ValueError: the wheel came off" in told.text
    assert [m.alive for m in messages(presence)] == [True, False]
    assert "part_failed part=stepping" in caplog.text
    assert "Traceback" in caplog.text
