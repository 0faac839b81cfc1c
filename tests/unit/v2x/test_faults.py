"""Faults of the bus in memory: every kind happens, by the seed, and never to one's own messages."""

import pytest

from scm.clock import NS_PER_S, StepClock
from scm.v2x.bus import Mailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Answer, Call
from scm.v2x.faults import FaultRates, Faults
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat


def spat(seq):
    return Spat(junction="x1", t_ns=1, seq=seq, mode="plan", plan="calm", groups=())


class Net:
    def __init__(self, seed=1, **weather):
        self.clock = StepClock()
        self.faults = Faults(seed, FaultRates(**weather))
        self.network = MemoryNetwork(self.clock, self.faults)
        self.sender, self.hearer = (self.network.bus("city", name) for name in ("a", "b"))
        self.heard = Mailbox(10_000)
        self.hearer.subscribe(Spat, {}, self.heard)

    def send(self, count=400):
        for seq in range(count):
            self.sender.publish(spat(seq))
        self.clock.set_ns(self.clock.now_ns() + NS_PER_S)
        self.network.expire()
        return [item.message.seq for item in self.heard.drain()]


def test_without_weather_nothing_happens():
    assert Net().send() == list(range(400))


def test_the_share_of_lost_messages_is_as_configured():
    assert 60 < 400 - len(Net(drop=0.25).send()) < 140


def test_the_share_of_duplicates_is_as_configured():
    came = Net(duplicate=0.25).send()
    assert set(came) == set(range(400))
    assert 60 < len(came) - 400 < 140


def test_what_is_late_is_overtaken_and_comes_within_the_longest_delay():
    net = Net(late=0.5, late_s=0.5)
    came = net.send()
    assert sorted(came) == list(range(400))
    assert came != sorted(came)


def test_what_is_late_has_the_time_of_its_arrival():
    net = Net(late=1.0, late_s=0.5)
    net.sender.publish(spat(1))
    assert net.heard.drain() == []
    net.clock.set_ns(NS_PER_S)
    net.network.expire()
    (item,) = net.heard.drain()
    assert 0 < item.t_ns <= 0.5 * NS_PER_S, "and not that of the next look"


def test_one_seed_is_one_history_and_another_is_another():
    facts = {"drop": 0.2, "duplicate": 0.2, "late": 0.5}
    assert Net(3, **facts).send() == Net(3, **facts).send() != Net(4, **facts).send()


def test_the_sides_of_a_partition_receive_nothing_from_each_other_until_it_ends():
    net = Net()
    net.faults.partition(["b"])
    assert net.send(3) == []
    net.faults.partition(["a", "b"])
    assert net.send(3) == [0, 1, 2]
    net.faults.partition([])
    assert net.send(3) == [0, 1, 2]


def test_a_station_always_receives_its_own_messages_and_presence():
    net = Net(drop=1.0)
    own, presence = Mailbox(10), Mailbox(10)
    net.sender.subscribe(Spat, {}, own)
    net.hearer.subscribe(Presence, {}, presence)
    net.sender.announce("part")
    net.sender.publish(spat(1))
    assert len(own.drain()) == len(presence.drain()) == 1


def asking(net):
    """Ask one request; return what the server got and a way to answer the first of it."""
    requests, replies = Mailbox(10), Mailbox(10)
    net.hearer.serve(PlanRequest, {}, requests)
    net.sender.call(Call(PlanRequest(junction="x1", plan="calm", by="t"), 2.0), replies.put)
    return requests, replies


def test_a_request_may_come_twice_and_its_reply_comes_once():
    net = Net(duplicate=1.0)
    requests, replies = asking(net)
    items = requests.drain()
    assert len(items) == 2
    for item in items:
        net.hearer.answer(Answer(item, PlanReply(junction="x1", plan="calm")))
    assert len(replies.drain()) == 1


@pytest.mark.parametrize("lost", ["request", "answer"])
def test_a_lost_request_or_answer_is_a_timeout(lost):
    net = Net(drop=1.0 if lost == "request" else 0.0)
    requests, replies = asking(net)
    items = requests.drain()
    assert len(items) == (lost == "answer")
    net.faults.rates = FaultRates(drop=1.0)
    for item in items:
        net.hearer.answer(Answer(item, PlanReply(junction="x1", plan="calm")))
    net.clock.set_ns(3 * NS_PER_S)
    net.network.expire()
    assert [item.message.code for item in replies.drain()] == ["timeout"]


def test_what_is_on_its_way_to_a_station_that_left_is_lost():
    net = Net(late=1.0)
    requests, replies = asking(net)
    net.sender.publish(spat(1))
    net.hearer.close()
    net.clock.set_ns(NS_PER_S)
    net.network.expire()
    assert requests.drain() == net.heard.drain() == []
    assert [item.message.code for item in replies.drain()] == ["offline"]


def test_link_between_cities_has_rates_of_its_own():
    faults = Faults(1, FaultRates(drop=1.0))
    faults.link_rates = FaultRates()
    assert faults.delays("west/world", "east/world", over_link=True) == (0,)
    assert faults.delays("world", "traffic") == ()
    faults.link_rates = None
    assert faults.delays("west/world", "east/world", over_link=True) == ()
