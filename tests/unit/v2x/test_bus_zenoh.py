"""What is particular to the bus over Zenoh: its router comes and goes, and so do processes."""

import socket
import threading

import pytest

from scm.clock import WallClock, seconds
from scm.errors import LinkError, RunError
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import REQUERY_ALL_EVERY, ZenohBus, requery_interval
from scm.v2x.exchange import Call
from scm.v2x.message import encode
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.trip import Trip
from scm.v2x.router import Router, free_endpoint

CLOCK = WallClock()
NEVER = threading.Event()
PATIENCE_S = 30.0

pytestmark = pytest.mark.usefixtures("lasting_links")


def until(condition, also=lambda: None):
    began_ns = CLOCK.now_ns()
    while not condition():
        also()
        assert seconds(CLOCK.now_ns() - began_ns) < PATIENCE_S
        NEVER.wait(0.01)


def spat(seq=0):
    return Spat(junction="x1", t_ns=1, seq=seq, mode="plan", plan="calm", groups=())


def event(name):
    return CityEvent(severity="info", source="world", t_ns=1, name=name, text="a sentence")


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def router(endpoint):
    with Router(endpoint) as router:
        yield router


def test_without_a_router_the_error_names_the_endpoint(endpoint):
    with pytest.raises(LinkError, match=f"no city at '{endpoint}' within 0.3 s"):
        ZenohBus("city", "n1", endpoint, connect_timeout_s=0.3)


def test_an_endpoint_that_is_none_is_refused():
    with pytest.raises(LinkError, match="no city at 'nonsense'"):
        ZenohBus("city", "n1", "nonsense", connect_timeout_s=0.3)


def test_a_station_waits_for_a_router_that_comes_later(endpoint):
    opened = []

    def come_in():
        with ZenohBus("city", "n1", endpoint, connect_timeout_s=PATIENCE_S) as bus:
            opened.append(bus.connected)

    early = threading.Thread(target=come_in)
    early.start()
    NEVER.wait(0.3)
    assert opened == []
    with Router(endpoint):
        early.join(PATIENCE_S)
    assert opened == [True]


def test_only_events_without_a_rate_are_requested_again():
    assert requery_interval(CityEvent, REQUERY_ALL_EVERY) == REQUERY_ALL_EVERY
    assert requery_interval(None, REQUERY_ALL_EVERY) == REQUERY_ALL_EVERY
    assert requery_interval(Trip, REQUERY_ALL_EVERY) is None


def test_two_routers_at_one_endpoint_are_refused(router):
    with pytest.raises(RunError, match="does another city run there"), Router(router.listen):
        pass


def test_a_router_leaves_its_port_when_it_ends(endpoint):
    with Router(endpoint):
        pass
    host, port = endpoint.removeprefix("tcp/").split(":")
    with socket.socket() as probe:
        assert probe.connect_ex((host, int(port))) != 0


def test_when_the_router_stops_all_stations_are_notified_and_streams_are_dropped(endpoint):
    with Router(endpoint) as router:
        bus = ZenohBus("city", "traffic", endpoint)
        listener = ZenohBus("city", "api", endpoint)
        mailbox = Mailbox(100)
        with bus, listener:
            listener.subscribe(Spat, {}, mailbox)
            until(lambda: bool(mailbox.drain()), also=lambda: bus.publish(spat()))
            router.__exit__(None, None, None)
            until(lambda: not bus.connected and not listener.connected)
            mailbox.drain()  # what was still on its way
            bus.publish(spat(1))
            with Router(endpoint):
                until(lambda: bus.connected and listener.connected)
                until(lambda: len(mailbox._items) > 0, also=lambda: bus.publish(spat(2)))
            assert {item.message.seq for item in mailbox.drain()} == {2}


def test_events_published_without_a_router_arrive_when_it_is_back(endpoint):
    with Router(endpoint) as router:
        world = ZenohBus("city", "world", endpoint)
        api = ZenohBus("city", "api", endpoint)
        names, mailbox = [], Mailbox(100)

        def received():
            names.extend(item.message.name for item in mailbox.drain())
            return names

        with world, api:
            api.subscribe(CityEvent, {}, mailbox)
            world.publish(event("before"))
            until(lambda: received() == ["before"])
            router.__exit__(None, None, None)
            until(lambda: not world.connected and not api.connected)
            for name in ("one", "two", "three"):
                world.publish(event(name))
            with Router(endpoint):
                until(lambda: received() == ["before", "one", "two", "three"])


def test_a_call_without_a_router_is_refused_at_once(endpoint):
    replies = Mailbox(1)
    with Router(endpoint) as router, ZenohBus("city", "api", endpoint) as bus:
        router.__exit__(None, None, None)
        until(lambda: not bus.connected)
        bus.call(Call(PlanRequest(junction="x1", plan="calm", by="me")), replies.put)
        (reply,) = replies.drain()
    assert reply.message.code == "offline"


def test_rubbish_on_a_key_is_dropped_and_the_next_message_arrives(router):
    sender = ZenohBus("city", "traffic", router.listen)
    listener = ZenohBus("city", "api", router.listen)
    mailbox = Mailbox(100)
    with sender, listener:
        listener.subscribe(Spat, {}, mailbox)
        until(lambda: bool(mailbox.drain()), also=lambda: sender.publish(spat()))
        sender._session.put("scm/@v1/city/tl/x1/spat", b"\xff rubbish")
        sender.publish(spat(9))
        until(lambda: [i.message.seq for i in mailbox.drain() if i.message.seq] == [9])
        assert listener.rejected == 1


def test_a_request_that_cannot_be_read_is_refused_as_invalid(router):
    server = ZenohBus("city", "traffic", router.listen)
    caller = ZenohBus("city", "api", router.listen)
    requests, replies = Mailbox(10), Mailbox(10)

    class OldRequest(PlanRequest, kw_only=True, frozen=True):
        plan: int

    with server, caller:
        server.serve(PlanRequest, {}, requests)

        def ask():
            caller.call(Call(OldRequest(junction="x1", plan=3, by="me"), 0.2), replies.put)
            requests.drain()

        codes = []
        until(
            lambda: codes.extend(i.message.code for i in replies.drain()) or "invalid" in codes,
            also=ask,
        )


@pytest.mark.parametrize("key", ["**", "tl/**", "tl/*/req"])
def test_a_request_to_all_stations_is_refused_and_stops_no_other(router, key):
    server = ZenohBus("city", "traffic", router.listen)
    caller = ZenohBus("city", "api", router.listen)
    requests, answers = Mailbox(10), []
    body, _ = encode(PlanRequest(junction="x1", plan="calm", by="me"))

    def ask():
        get = caller._session.get(f"scm/@v1/city/{key}", payload=body, timeout=0.2)
        threading.Thread(target=lambda: answers.extend(reply.err for reply in get)).start()
        assert requests.drain() == []

    with server, caller:
        server.serve(PlanRequest, {}, requests)
        until(lambda: any(b"invalid" in e.payload.to_bytes() for e in answers if e), also=ask)


def test_closing_under_fire_does_not_hang(router):
    sender = ZenohBus("city", "traffic", router.listen)
    firing = threading.Event()

    def fire():
        while not firing.wait(0.0002):
            sender.publish(spat())

    gunner = threading.Thread(target=fire)
    with sender:
        gunner.start()
        for _ in range(20):
            mailbox = Mailbox(10)
            with ZenohBus("city", "api", router.listen) as listener:
                listener.subscribe(Spat, {}, mailbox)
                listener.subscribe(Presence, {}, mailbox)
                until(lambda box=mailbox: bool(box.drain()))
        firing.set()
        gunner.join(PATIENCE_S)
    assert not gunner.is_alive()
