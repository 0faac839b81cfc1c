"""Lockstep: order, time, calls, joining and leaving, and the same run twice."""

from itertools import pairwise

import pytest

from scm.clock import NS_PER_MS
from scm.errors import RunError
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Service, Subscription
from scm.v2x.exchange import Answer, Call
from scm.v2x.message import Message, Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.trip import Trip


def event(source, name, t_ns=0):
    return CityEvent(severity="info", source=source, t_ns=t_ns, name=name, text=name)


class Talker(BasePart):
    """Says one event each step, and notes everything it hears with the time."""

    role = "part"
    services = ()

    def __init__(self, name, period_ms=20, subscriptions=()):
        self.name = name
        self.period_ns = period_ms * NS_PER_MS
        self.subscriptions = subscriptions
        self.heard = []
        self.steps = []

    def step(self, now_ns, inbox):
        self.steps.append(now_ns)
        self.heard += [(now_ns, item.message) for item in inbox]
        return [event(self.name, f"step{len(self.steps)}", now_ns)]

    def finish(self, now_ns):
        return [event(self.name, "bye", now_ns)]


class Planner(Talker):
    """Answers every second request for a plan, two steps after it came."""

    services = (Service(PlanRequest),)

    def __init__(self, name="planner"):
        super().__init__(name)
        self.open = []
        self.asked = 0

    def step(self, now_ns, inbox):
        due = [item for when, item in self.open if when < now_ns - self.period_ns]
        self.open = [(when, item) for when, item in self.open if item not in due]
        self.open += [(now_ns, item) for item in inbox]
        self.asked += len(inbox)
        return [
            Answer(item, PlanReply(junction=item.message.junction, plan=item.message.plan))
            for item in due
        ]

    def finish(self, now_ns):
        return []


ALL = (Subscription(CityEvent),)


def plan_request(request_id="", plan="calm"):
    return PlanRequest(junction="x1", plan=plan, by="test", request_id=request_id)


def test_steps_come_in_order_of_time_then_of_adding():
    order = []

    class Noting(Talker):
        def step(self, now_ns, inbox):
            order.append((now_ns // NS_PER_MS, self.name))
            return []

    with Lockstep([Noting("slow", 20), Noting("fast", 10)]) as city:
        city.run_for(0.02)
    assert order == [(0, "slow"), (0, "fast"), (10, "fast"), (20, "slow"), (20, "fast")]


def test_a_message_reaches_later_steps_of_the_same_instant_and_no_earlier_one():
    first, second = Talker("first", subscriptions=ALL), Talker("second", subscriptions=ALL)
    with Lockstep([first, second]) as city:
        city.run_for(0.0)
        assert [m.source for _, m in second.heard] == ["first"]
        assert first.heard == []
        city.run_for(0.02)
    assert [m.name for t, m in first.heard if m.source == "second" and t == 20 * NS_PER_MS] == [
        "step1"
    ]


def test_two_runs_in_a_row_equal_one_of_the_whole_length():
    def heard(spans):
        listener = Talker("listener", 30, subscriptions=ALL)
        with Lockstep([Talker("a", 10), listener, Talker("b", 15)]) as city:
            for span_s in spans:
                city.run_for(span_s)
        return listener.heard

    assert heard([0.5, 0.5]) == heard([1.0])
    assert len(heard([1.0])) > 100


def test_the_clock_ends_where_the_run_was_to_end():
    with Lockstep([Talker("a", 30)], start_ns=7) as city:
        city.run_for(0.1)
        assert city.now_ns == 7 + 100 * NS_PER_MS


def test_run_until_stops_at_the_first_instant_at_which_the_condition_holds():
    talker = Talker("a", 20)
    with Lockstep([talker]) as city:
        city.run_until(lambda: len(talker.steps) == 3, timeout_s=1.0)
        assert city.now_ns == 40 * NS_PER_MS


def test_run_until_says_in_words_what_did_not_happen():
    with (
        Lockstep([Talker("a")]) as city,
        pytest.raises(RunError, match=r"0\.2 s.*n1 waits at the red light.*running: a"),
    ):
        city.run_until(lambda: False, timeout_s=0.2, what="n1 waits at the red light")


def test_a_call_runs_the_city_until_the_reply_is_there():
    with Lockstep([Planner()]) as city:
        reply = city.call(plan_request())
        assert reply == PlanReply(junction="x1", plan="calm")
        assert 20 * NS_PER_MS < city.now_ns <= 60 * NS_PER_MS


def test_a_call_that_nobody_serves_is_refused_at_once():
    with Lockstep([Talker("a")]) as city:
        reply = city.call(plan_request())
        assert isinstance(reply, Refused)
        assert reply.code == "offline"
        assert city.now_ns == 0


def test_a_call_that_is_never_answered_is_refused_when_its_time_is_up():
    class Deaf(Planner):
        def step(self, now_ns, inbox):
            return []

    with Lockstep([Deaf()]) as city:
        reply = city.call(plan_request(), timeout_s=0.5)
        assert isinstance(reply, Refused)
        assert reply.code == "timeout"
        assert city.now_ns == 500 * NS_PER_MS


def test_a_part_can_call_and_finds_the_reply_in_a_later_inbox():
    class Caller(Talker):
        def step(self, now_ns, inbox):
            self.heard += [item for item in inbox if item.call is not None]
            return [Call(plan_request())] if now_ns == 0 else []

    caller = Caller("caller")
    with Lockstep([Planner(), caller]) as city:
        city.run_for(0.1)
    assert [item.message.plan for item in caller.heard] == ["calm"]


def test_a_retry_with_the_same_request_id_gets_the_stored_answer():
    planner = Planner()
    with Lockstep([planner]) as city:
        first = city.call(plan_request("r1"))
        again = city.call(plan_request("r1"))
        assert first == again
        assert planner.asked == 1


def test_a_retry_while_the_first_is_still_open_gets_the_same_answer():
    planner, replies = Planner(), []
    with Lockstep([planner]) as city:
        for _ in range(2):
            city.bus.call(Call(plan_request("r1")), replies.append)
        city.run_for(0.2)
    assert [item.message.plan for item in replies] == ["calm", "calm"]
    assert planner.asked == 1


def test_a_request_id_used_for_another_request_is_refused():
    with Lockstep([Planner()]) as city:
        city.call(plan_request("r1"))
        reply = city.call(plan_request("r1", plan="busy"))
        assert isinstance(reply, Refused)
        assert reply.code == "invalid"


def test_a_part_added_while_running_steps_from_now_on():
    late = Talker("late")
    with Lockstep([Talker("a")]) as city:
        city.run_for(0.1)
        city.add(late)
        city.run_for(0.04)
    assert [t // NS_PER_MS for t in late.steps] == [100, 120, 140]


def test_a_removed_part_says_its_last_words_and_its_presence_ends():
    leaving = Talker("leaving")
    with Lockstep([leaving]) as city:
        words, presence = (
            city.subscribe(Subscription(CityEvent)),
            city.subscribe(Subscription(Presence)),
        )
        city.run_for(0.04)
        city.remove(leaving)
        city.run_for(0.1)
        assert words.drain()[-1].message.name == "bye"
        assert [item.message.alive for item in presence.drain()] == [True, False]
        assert len(leaving.steps) == 3


def test_removing_a_part_twice_is_refused_by_name():
    part = Talker("a")
    with Lockstep([part]) as city:
        city.remove(part)
        with pytest.raises(RunError, match="a is not running"):
            city.remove(part)


def test_the_error_of_a_part_says_whose_it_is_and_when():
    class Broken(Talker):
        def step(self, now_ns, inbox):
            if now_ns > 0:
                raise ZeroDivisionError
            return []

    with Lockstep([Broken("broken")]) as city, pytest.raises(ZeroDivisionError) as caught:
        city.run_for(1.0)
    assert caught.value.__notes__ == ["in the step of broken at 0.020 s"]


def test_what_the_script_publishes_is_heard():
    listener = Talker("listener", subscriptions=(Subscription(Trip, {"vehicle": "n1"}),))
    with Lockstep([listener]) as city:
        for vehicle in ("n1", "n2"):
            city.publish(
                Trip(
                    vehicle=vehicle,
                    trip_id="t",
                    t_ns=0,
                    route=(),
                    done_m=0.0,
                    length_m=None,
                    started_ns=0,
                )
            )
        city.run_for(0.0)
    assert [m.vehicle for _, m in listener.heard] == ["n1"]


def test_a_part_that_asks_for_raw_samples_finds_them_in_its_inbox():
    class Recorder(Talker):
        def step(self, now_ns, inbox):
            self.heard += [(sample.key, sample.t_ns) for sample in inbox]
            return []

    recorder = Recorder("record", subscriptions=(Subscription(Message, raw=True),))
    with Lockstep([Talker("a"), recorder]) as city:
        city.run_for(0.04)
    assert recorder.heard[:3] == [
        ("scm/@v1/city/event/info/a", n * 20 * NS_PER_MS) for n in range(3)
    ]


def test_everybody_finishes_when_the_city_closes():
    class Finishing(Talker):
        def finish(self, now_ns):
            self.heard.append(now_ns)
            return []

    parts = [Finishing("a"), Finishing("b")]
    with Lockstep(parts) as city:
        city.run_for(0.05)
    assert [part.heard for part in parts] == [[50 * NS_PER_MS], [50 * NS_PER_MS]]


def test_time_never_goes_back_between_steps():
    talker = Talker("a", 7)
    with Lockstep([talker]) as city:
        city.run_for(0.1)
    assert all(b - a == 7 * NS_PER_MS for a, b in pairwise(talker.steps))


class Picky(Talker):
    """Subscribes to trips on demand, and knows whether the events of `x` have subscribers."""

    def __init__(self, name):
        super().__init__(name)
        self.is_wanted = None

    def attach(self, is_wanted):
        self.is_wanted = is_wanted


def trip(done_m):
    return Trip(
        vehicle="n1", trip_id="t", t_ns=0, route=(), done_m=done_m, length_m=None, started_ns=0
    )


def test_a_part_that_changes_what_it_hears_is_followed():
    picky = Picky("picky")
    with Lockstep([picky]) as city:
        city.publish(trip(1.0))
        city.run_for(0.04)
        picky.subscriptions = (Subscription(Trip),)
        city.run_for(0.02)
        city.publish(trip(2.0))
        city.run_for(0.02)
        picky.subscriptions = ()
        city.run_for(0.02)
        city.publish(trip(3.0))
        city.run_for(0.04)
    done = [said.done_m for _, said in picky.heard if isinstance(said, Trip)]
    assert done[-1] == 2.0
    assert 3.0 not in done


def test_a_part_may_ask_whether_anybody_would_hear_it():
    picky = Picky("picky")
    with Lockstep([picky]) as city:
        assert not picky.is_wanted(Trip, {})
        city.add(Talker("hearer", subscriptions=(Subscription(Trip, {"vehicle": "n1"}),)))
        assert picky.is_wanted(Trip, {"vehicle": "n1"})
        assert not picky.is_wanted(Trip, {"vehicle": "n2"})
