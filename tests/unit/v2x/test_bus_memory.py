"""What is particular to the bus in memory: order, stepped time, the rules of its network."""

import pytest

from scm.clock import NS_PER_S, StepClock
from scm.v2x.bus import Mailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.exchange import Call
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.trip import Trip


def event(source, name, t_ns=0):
    return CityEvent(severity="info", source=source, t_ns=t_ns, name=name, text="a sentence")


@pytest.fixture
def clock():
    return StepClock()


@pytest.fixture
def network(clock):
    return MemoryNetwork(clock)


def test_late_joiners_get_the_kept_events_of_all_stations_in_order_of_time(clock, network):
    a, b = network.bus("city", "a"), network.bus("city", "b")
    for n, bus in enumerate([a, b, a, b]):
        clock.set_ns(n)
        bus.publish(event(bus.station, f"e{n}"))
    mailbox = Mailbox(10)
    network.bus("city", "late").subscribe(CityEvent, {}, mailbox)
    assert [item.message.name for item in mailbox.drain()] == ["e0", "e1", "e2", "e3"]


def test_cities_on_one_network_are_isolated(network):
    mailbox = Mailbox(10)
    network.bus("one", "api").subscribe(CityEvent, {}, mailbox)
    network.bus("two", "world").publish(event("world", "x"))
    assert mailbox.drain() == []


def test_the_time_of_arrival_is_the_time_of_the_clock(clock, network):
    mailbox = Mailbox(10)
    network.bus("city", "api").subscribe(CityEvent, {}, mailbox)
    clock.set_ns(42)
    network.bus("city", "world").publish(event("world", "x"))
    clock.set_ns(50)
    assert [item.t_ns for item in mailbox.drain()] == [42]


def test_a_closed_subscription_receives_nothing_more(network):
    sender, listener = network.bus("city", "world"), network.bus("city", "api")
    mailbox = Mailbox(10)
    listener.subscribe(CityEvent, {}, mailbox)
    listener.close()
    sender.publish(event("world", "x"))
    assert mailbox.drain() == []


def test_sessions_are_the_same_in_every_run(clock):
    names = [
        [network.bus("city", "n1").session for _ in range(3)]
        for network in (MemoryNetwork(clock), MemoryNetwork(clock))
    ]
    assert names[0] == names[1]


def test_a_server_that_leaves_with_an_open_request_refuses_it(network):
    server, caller = network.bus("city", "traffic"), network.bus("city", "api")
    requests, replies = Mailbox(10), Mailbox(10)
    server.serve(PlanRequest, {}, requests)
    caller.call(Call(PlanRequest(junction="x1", plan="calm", by="me")), replies.put)
    requests.drain()
    server.close()
    assert [item.message.code for item in replies.drain()] == ["offline"]


def test_time_alone_refuses_nothing_before_its_timeout(clock, network):
    server, caller = network.bus("city", "traffic"), network.bus("city", "api")
    replies = Mailbox(10)
    server.serve(PlanRequest, {}, Mailbox(10))
    caller.call(Call(PlanRequest(junction="x1", plan="calm", by="me"), 2.0), replies.put)
    clock.set_ns(2 * NS_PER_S - 1)
    network.expire()
    assert replies.drain() == []
    clock.set_ns(2 * NS_PER_S)
    network.expire()
    assert [item.message.code for item in replies.drain()] == ["timeout"]


def test_the_end_of_a_presence_is_not_kept(network):
    gone = network.bus("city", "n1")
    gone.announce("v")
    gone.close()
    mailbox = Mailbox(10)
    network.bus("city", "api").subscribe(Presence, {}, mailbox)
    assert mailbox.drain() == []


def test_a_message_is_read_only_when_it_is_taken(network):
    sender, listener = network.bus("city", "n1"), network.bus("city", "api")
    mailbox = Mailbox(1)
    listener.subscribe(Trip, {}, mailbox)
    for _ in range(2):
        sender.publish(
            Trip(
                vehicle="n1",
                trip_id="t",
                t_ns=0,
                route=(),
                done_m=float("nan"),
                length_m=None,
                started_ns=0,
            )
        )
    assert listener.rejected == 0
    assert mailbox.drain() == []
    assert listener.rejected == 1
