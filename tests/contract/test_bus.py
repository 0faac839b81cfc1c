"""One contract for every bus: what is promised in `scm.v2x.bus` holds in memory and over Zenoh."""

import threading
from contextlib import ExitStack

import msgspec
import pytest

from scm.clock import StepClock, WallClock, nanoseconds, seconds
from scm.errors import LinkError, MessageError
from scm.v2x.bus import Mailbox, RawMailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.etsi.convert import cam_of
from scm.v2x.exchange import Answer, Call
from scm.v2x.message import Refused, decode
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.router import Router, free_endpoint

PATIENCE_S = 30.0

pytestmark = pytest.mark.usefixtures("lasting_links")


class MemoryCity:
    def __init__(self):
        self.clock = StepClock()
        self.network = MemoryNetwork(self.clock)
        self.buses = ExitStack()

    def bus(self, station, city="test"):
        return self.buses.enter_context(self.network.bus(city, station))

    def pass_time(self, span_s):
        self.clock.set_ns(self.clock.now_ns() + nanoseconds(span_s))
        self.network.expire()

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.buses.close()


class ZenohCity:
    def __init__(self):
        self.clock = WallClock()
        self.buses = ExitStack()
        self.router = Router(free_endpoint())

    def bus(self, station, city="test"):
        return self.buses.enter_context(ZenohBus(city, station, self.router.listen))

    def pass_time(self, span_s):
        threading.Event().wait(span_s)

    def __enter__(self):
        self.router.__enter__()
        return self

    def __exit__(self, *exc):
        self.buses.close()
        self.router.__exit__(*exc)


@pytest.fixture(params=[MemoryCity, ZenohCity], ids=["memory", "zenoh"])
def city(request):
    with request.param() as city:
        yield city


def gather(city, mailbox, count, also=lambda: None):
    """Return what arrives, as soon as there are `count` items; keep doing `also` until then."""
    items, began_ns = [], city.clock.now_ns()
    while len(items) < count:
        also()
        items += mailbox.drain()
        if len(items) < count:
            city.pass_time(0.01)
        waited_s = seconds(city.clock.now_ns() - began_ns)
        assert waited_s < PATIENCE_S, f"only {len(items)} of {count} arrived: {items}"
    return items


def nothing_more(city, mailbox):
    city.pass_time(0.2)
    return mailbox.drain() == []


def trip(vehicle="n1", done_m=0.0):
    return Trip(
        vehicle=vehicle,
        trip_id="t1",
        t_ns=1,
        route=("a", "b"),
        done_m=done_m,
        length_m=None,
        started_ns=0,
    )


def spat(junction="x1", seq=0):
    return Spat(junction=junction, t_ns=1, seq=seq, mode="plan", plan="calm", groups=())


def cam(receiver, t_ns):
    state = VehicleState(
        vehicle="n1", t_ns=t_ns, seq=1, x_m=1.0, y_m=2.0, yaw_rad=0.0, speed_mps=0.5,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.1, source="simulated",
    )  # fmt: skip
    body = cam_of(state, length_m=0.5, width_m=0.2, front_m=0.4)
    return CamRx(receiver=receiver, station="n1", t_ns=t_ns, body=body)


def news(name, source="world"):
    return CityEvent(severity="info", source=source, t_ns=1, name=name, text="a sentence")


def plan(junction="x1", name="calm"):
    return PlanRequest(junction=junction, plan=name, by="test")


def subscribed(city, sender, listener, kind, where, sample):
    """Return a mailbox through which `sample` has been seen: the way is open, and empty again."""
    mailbox = Mailbox(1000)
    listener.subscribe(kind, where, mailbox)
    gather(city, mailbox, 1, also=lambda: sender.publish(sample))
    empty(city, sender, msgspec.structs.replace(sample, t_ns=2), mailbox)
    return mailbox


def empty(city, sender, fence, *mailboxes):
    """Empty mailboxes of all that was sent so far: the fence comes after it."""
    sender.publish(fence)
    for mailbox in mailboxes:
        found(city, mailbox, lambda item: item.message == fence)


def found(city, mailbox, is_wanted, also=lambda: None):
    """Return the first item that is wanted; keep doing `also` until it comes."""
    items = []

    def look():
        also()
        items.extend(filter(is_wanted, mailbox.drain()))
        return items

    settles(city, look)
    return items[0]


def test_a_stream_arrives_as_it_was_sent(city):
    sender, listener = city.bus("traffic"), city.bus("api")
    mailbox = subscribed(city, sender, listener, Spat, {}, spat())
    for seq in range(20):
        sender.publish(spat(seq=seq))
        assert [i.message for i in gather(city, mailbox, 1)] == [spat(seq=seq)]


def test_what_arrives_is_a_copy_with_the_time_of_arrival(city):
    sender, listener = city.bus("traffic"), city.bus("api")
    mailbox = subscribed(city, sender, listener, Spat, {}, spat())
    sent = spat(seq=7)
    before_ns = city.clock.now_ns()
    sender.publish(sent)
    (item,) = gather(city, mailbox, 1)
    assert item.message is not sent
    assert before_ns <= item.t_ns <= city.clock.now_ns()
    assert item.call is None


def test_a_subscription_receives_only_its_keys(city):
    sender, listener = city.bus("traffic"), city.bus("api")
    mailbox = subscribed(city, sender, listener, Spat, {"junction": "x2"}, spat("x2"))
    sender.publish(spat("x1", seq=1))
    sender.publish(spat("x2", seq=2))
    assert [i.message.seq for i in gather(city, mailbox, 1)] == [2]
    assert nothing_more(city, mailbox)


def test_a_key_part_that_does_not_exist_is_refused_by_name(city):
    with pytest.raises(MessageError, match="no part named 'car'"):
        city.bus("api").subscribe(Spat, {"car": "n1"}, Mailbox(1))


def test_a_name_that_may_not_stand_in_a_key_is_refused(city):
    with pytest.raises(MessageError, match=r"Spat\.junction.*'x/1'"):
        city.bus("traffic").publish(spat("x/1"))


def test_raw_bytes_travel_beside_their_header(city):
    sender, listener = city.bus("world"), city.bus("api")
    scan = LidarScan(
        vehicle="n1", t_ns=5, beams=2, range_min_m=0.1, range_max_m=12.0, payload=bytes(range(256))
    )
    mailbox = Mailbox(10)
    listener.subscribe(LidarScan, {}, mailbox)
    items = gather(city, mailbox, 1, also=lambda: sender.publish(scan))
    assert items[0].message == scan


def test_a_full_mailbox_drops_the_oldest_and_counts(city):
    sender, listener = city.bus("traffic"), city.bus("api")
    fence = subscribed(city, sender, listener, Spat, {}, spat())
    small = Mailbox(3)
    listener.subscribe(Spat, {}, small)
    gather(city, small, 1, also=lambda: sender.publish(spat()))
    empty(city, sender, spat(seq=99), fence, small)
    dropped = small.dropped
    for seq in range(10):
        sender.publish(spat(seq=seq))
        gather(city, fence, 1)
    settles(city, lambda: small.dropped - dropped == 7)
    assert [i.message.seq for i in small.drain()] == [7, 8, 9]


def test_of_a_frame_that_many_receive_a_mailbox_may_want_one_copy(city):
    world, ear = city.bus("world"), city.bus("ear")
    once = Mailbox(1000, once=True)
    ear.subscribe(CamRx, {}, once)
    gather(city, once, 1, also=lambda: world.publish(cam("rsu-a", 0)))
    for receiver in ("rsu-a", "rsu-b", "rsu-c"):
        world.publish(cam(receiver, 1))
    world.publish(cam("rsu-c", 2))
    received = []

    def look():
        received.extend(item.message.t_ns for item in once.drain())
        return 2 in received

    settles(city, look)
    assert [t_ns for t_ns in received if t_ns > 0] == [1, 2]


def test_a_station_can_receive_its_own_messages(city):
    bus = city.bus("api")
    mailbox = Mailbox(10)
    bus.subscribe(Spat, {}, mailbox)
    bus.publish(spat(seq=4))
    assert [i.message.seq for i in gather(city, mailbox, 1)] == [4]


def test_a_late_joiner_gets_the_last_events_of_each_key_and_then_the_new_ones(city):
    sender, received = city.bus("world"), Mailbox(1000)
    city.bus("eye").subscribe(CityEvent, {}, received)
    for n in range(CityEvent.HISTORY_DEPTH + 5):
        sender.publish(news(f"e{n}"))
    sender.publish(news("other", source="gate"))
    missing = {f"e{CityEvent.HISTORY_DEPTH + 4}", "other"}  # till then it would join amid them

    def all_sent():
        missing.difference_update(item.message.name for item in received.drain())
        return not missing

    settles(city, all_sent)
    mailbox = Mailbox(1000)
    city.bus("api").subscribe(CityEvent, {}, mailbox)
    names = [i.message.name for i in gather(city, mailbox, CityEvent.HISTORY_DEPTH + 1)]
    sender.publish(news("new"))
    names += [i.message.name for i in gather(city, mailbox, 1)]
    kept = [f"e{n}" for n in range(5, CityEvent.HISTORY_DEPTH + 5)]
    assert [name for name in names if name != "other"] == [*kept, "new"]
    assert names.count("other") == 1


def test_of_a_state_that_is_kept_once_a_late_joiner_gets_the_newest(city):
    sender, received = city.bus("world"), Mailbox(10)
    city.bus("api").subscribe(CityStop, {}, received)
    for engaged in (True, False, True):
        sender.publish(CityStop(t_ns=1, engaged=engaged, by=str(engaged)))
        assert len(gather(city, received, 1)) == 1  # else it joins amid them, and hears fewer
    mailbox = Mailbox(10)
    city.bus("n1").subscribe(CityStop, {}, mailbox)
    assert [i.message.engaged for i in gather(city, mailbox, 1)] == [True]
    assert nothing_more(city, mailbox)


def test_events_of_a_station_that_left_are_not_sent_to_late_joiners(city):
    sender = city.bus("world")
    sender.publish(trip())
    sender.close()
    mailbox = Mailbox(10)
    city.bus("api").subscribe(Trip, {}, mailbox)
    assert nothing_more(city, mailbox)


def test_a_stream_is_not_kept_for_late_joiners(city):
    sender, received = city.bus("traffic"), Mailbox(10)
    city.bus("record").subscribe(Spat, {}, received)

    def arrives():
        sender.publish(spat())
        return bool(received.drain())

    settles(city, arrives)
    while not nothing_more(city, received):
        pass  # else one may still be on its way
    mailbox = Mailbox(10)
    city.bus("api").subscribe(Spat, {}, mailbox)
    assert nothing_more(city, mailbox)


def test_the_raw_firehose_brings_everything_with_its_key(city):
    sender, recorder = city.bus("world"), city.bus("record")
    sender.publish(news("before"))
    raw = RawMailbox(1000)
    recorder.subscribe_raw(raw)
    found(city, raw, lambda sample: "/event/" in sample.key)
    found(city, raw, lambda sample: True, also=lambda: sender.publish(spat()))
    sender.publish(spat("fence"))
    found(city, raw, lambda sample: "/fence/" in sample.key)
    scan = LidarScan(
        vehicle="n1", t_ns=5, beams=1, range_min_m=0.1, range_max_m=12.0, payload=b"abcd"
    )
    sent = [spat("x9", 3), scan, news("after")]
    samples = []
    for message in sent:
        sender.publish(message)
        samples += gather(city, raw, 1)
    read = [decode(type(m), s.body, s.attachment) for m, s in zip(sent, samples, strict=True)]
    assert read == sent
    assert [s.key for s in samples] == [
        "scm/@v1/test/tl/x9/spat",
        "scm/@v1/test/v/n1/scan",
        "scm/@v1/test/event/info/world",
    ]


def test_the_raw_firehose_begins_with_the_events_that_are_kept(city):
    sender = city.bus("world")
    sender.publish(news("before"))
    raw = RawMailbox(1000)
    city.bus("record").subscribe_raw(raw)
    (sample,) = gather(city, raw, 1)
    assert decode(CityEvent, sample.body) == news("before")


def test_a_presence_subscription_reports_present_joining_and_leaving_stations(city):
    here, watcher = city.bus("world"), city.bus("api")
    here.announce("part")
    mailbox = Mailbox(10)
    watcher.subscribe(Presence, {}, mailbox)
    (first,) = gather(city, mailbox, 1)
    assert first.message == Presence(role="part", station="world", session=here.session, alive=True)
    comer = city.bus("n1")
    comer.announce("v")
    (second,) = gather(city, mailbox, 1)
    comer.close()
    (third,) = gather(city, mailbox, 1)
    assert (second.message.station, second.message.alive) == ("n1", True)
    assert (third.message.station, third.message.alive) == ("n1", False)


def test_presence_can_be_watched_by_role(city):
    mailbox = Mailbox(10)
    city.bus("world").announce("part")
    city.bus("n1").announce("v")
    city.bus("api").subscribe(Presence, {"role": "v"}, mailbox)
    assert [i.message.station for i in gather(city, mailbox, 1)] == ["n1"]
    assert nothing_more(city, mailbox)


def test_two_runs_of_one_station_have_two_sessions(city):
    assert city.bus("n1").session != city.bus("n1").session


class Asking:
    """A server and a caller, with the way between them open."""

    def __init__(self, city, where=None):
        self.city = city
        self.server, self.caller = city.bus("traffic"), city.bus("api")
        self.requests, self.replies = Mailbox(100), Mailbox(100)
        self.server.serve(PlanRequest, where or {}, self.requests)

    def ask(self, request=None, timeout_s=5.0):
        call = Call(request or plan(), timeout_s)
        self.caller.call(call, self.replies.put)
        return call

    def request(self):
        """Ask until the request arrives: the way may take an instant to open."""
        call = self.ask()
        while True:
            self.city.pass_time(0.01)
            if items := self.requests.drain():
                return call, items[0]
            if self.replies.drain():
                call = self.ask()


@pytest.fixture
def asking(city):
    return Asking(city)


def test_a_request_is_answered_by_the_station_that_serves_it(city, asking):
    call, request = asking.request()
    assert request.message == plan()
    asking.server.answer(Answer(request, PlanReply(junction="x1", plan="calm")))
    (reply,) = gather(city, asking.replies, 1)
    assert reply.message == PlanReply(junction="x1", plan="calm")
    assert reply.call is call


def test_a_refusal_reaches_the_caller_with_its_words(city, asking):
    _, request = asking.request()
    asking.server.answer(Answer(request, Refused(code="not_found", detail="no plan 'calm'")))
    (reply,) = gather(city, asking.replies, 1)
    assert reply.message == Refused(code="not_found", detail="no plan 'calm'")


def test_a_second_answer_to_the_same_request_is_ignored(city, asking):
    _, request = asking.request()
    for name in ("calm", "busy"):
        asking.server.answer(Answer(request, PlanReply(junction="x1", plan=name)))
    (reply,) = gather(city, asking.replies, 1)
    assert reply.message.plan == "calm"
    assert nothing_more(city, asking.replies)


def test_an_answer_of_another_class_is_refused_at_the_server(city, asking):
    _, request = asking.request()
    with pytest.raises(MessageError, match=r"PlanRequest.*CityStop.*PlanReply"):
        asking.server.answer(Answer(request, CityStop(t_ns=0, engaged=False)))


def test_a_request_without_a_server_is_refused_as_offline(city):
    replies = Mailbox(10)
    city.bus("api").call(Call(plan()), replies.put)
    (reply,) = gather(city, replies, 1)
    assert reply.message.code == "offline"
    expected = "the signal controller of junction x1 is not running, or cannot be reached"
    assert reply.message.detail == expected
    assert reply.message.asked == "PlanRequest on scm/@v1/test/tl/x1/req"


def test_a_request_that_is_not_answered_in_time_is_refused_as_timeout(city, asking):
    asking.request()
    asking.replies.drain()
    asking.ask(timeout_s=0.3)
    (reply,) = gather(city, asking.replies, 1)
    assert isinstance(reply.message, Refused)
    assert reply.message.code == "timeout"
    expected = "the signal controller of junction x1 did not answer within 0.3 s"
    assert reply.message.detail == expected
    assert reply.message.asked == "PlanRequest on scm/@v1/test/tl/x1/req"


def test_an_answer_after_the_timeout_is_ignored(city, asking):
    asking.request()
    asking.replies.drain()
    asking.ask(timeout_s=0.2)
    gather(city, asking.replies, 1)
    for request in asking.requests.drain():
        asking.server.answer(Answer(request, PlanReply(junction="x1", plan="calm")))
    assert nothing_more(city, asking.replies)


def test_a_server_of_one_name_receives_no_requests_for_others(city):
    asking = Asking(city, where={"junction": "x1"})
    asking.request()
    asking.ask(plan("x2"))
    (reply,) = gather(city, asking.replies, 1)
    assert reply.message.code == "offline"


def both_asked(city, asking):
    """Return another server, what it and the first one are asked, and how to hear the answer."""
    other, requests = city.bus("other"), Mailbox(1000)
    other.serve(PlanRequest, {}, requests)
    boxes = (requests, asking.requests)
    for box in boxes:  # until the caller knows both
        found(city, box, lambda item: True, also=lambda: asking.ask(timeout_s=0.1))
    call = asking.ask(plan(name="busy"))
    asked = [found(city, box, lambda item: item.message.plan == "busy") for box in boxes]
    return other, *asked, lambda: found(city, asking.replies, lambda item: item.call is call)


def test_of_two_servers_the_answer_without_a_refusal_counts(city, asking):
    other, refused, taken, reply = both_asked(city, asking)
    other.answer(Answer(refused, Refused(code="not_found", detail="not mine")))
    city.pass_time(0.05)
    asking.server.answer(Answer(taken, PlanReply(junction="x1", plan="busy")))
    assert reply().message == PlanReply(junction="x1", plan="busy")


@pytest.mark.parametrize("first", ["owned", "not_found"])
def test_of_two_refusals_the_one_that_knows_the_name_counts(city, asking, first):
    other, its, ours, reply = both_asked(city, asking)
    waiting = {"not_found": (other, its), "owned": (asking.server, ours)}
    for code in sorted(waiting, key=lambda code: code != first):
        server, request = waiting[code]
        server.answer(Answer(request, Refused(code=code, detail="no")))
        city.pass_time(0.05)
    assert reply().message.code == "owned"


def test_a_closed_bus_raises_an_error(city):
    bus = city.bus("api")
    assert bus.connected
    bus.close()
    bus.close()
    assert not bus.connected
    with pytest.raises(LinkError, match="'api' is closed"):
        bus.publish(spat())


def test_a_station_name_that_may_not_stand_in_a_key_is_refused(city):
    with pytest.raises(MessageError, match="station"):
        city.bus("N 7")


def picture(vehicle="n1", camera="front"):
    return CameraFrame(
        vehicle=vehicle, camera=camera, t_ns=1, width_px=2, height_px=1, payload=b"\xff\xd8"
    )


def settles(city, condition):
    """Wait until a condition holds: a subscription takes a moment to be known over Zenoh."""
    began_ns = city.clock.now_ns()
    while not condition():
        assert seconds(city.clock.now_ns() - began_ns) < PATIENCE_S
        city.pass_time(0.01)


def test_messages_without_a_subscriber_are_not_wanted(city):
    sender, hearer = city.bus("a"), city.bus("b")
    assert not sender.is_wanted(CameraFrame, {})
    mailbox = Mailbox(4)
    hearer.subscribe(CameraFrame, {"vehicle": "n1", "camera": "front"}, mailbox)
    settles(city, lambda: sender.is_wanted(CameraFrame, {"vehicle": "n1", "camera": "front"}))
    assert sender.is_wanted(CameraFrame, {})
    assert sender.is_wanted(CameraFrame, {"vehicle": "n1"})
    assert not sender.is_wanted(CameraFrame, {"vehicle": "n2"})
    assert not sender.is_wanted(CameraFrame, {"vehicle": "n1", "camera": "rear"})
    hearer.unsubscribe(mailbox)
    settles(city, lambda: not sender.is_wanted(CameraFrame, {}))


def test_a_wildcard_does_not_include_kinds_requested_by_name(city):
    sender, recorder = city.bus("a"), city.bus("b")
    everything, asked = RawMailbox(8), RawMailbox(8)
    recorder.subscribe_raw(everything)
    city.pass_time(0.05)
    assert not sender.is_wanted(CameraFrame, {})
    recorder.subscribe_raw(asked, CameraFrame)
    settles(city, lambda: sender.is_wanted(CameraFrame, {"vehicle": "n7", "camera": "rear"}))
    sender.publish(picture())
    (sample,) = gather(city, asked, 1)
    assert sample.key == "scm/@v1/test/v/n1/@camera/front"
    assert everything.drain() == []


def test_a_kind_requested_by_name_may_be_of_one_vehicle(city):
    sender, recorder = city.bus("a"), city.bus("b")
    asked = RawMailbox(8)
    recorder.subscribe_raw(asked, CameraFrame, {"vehicle": "n1"})
    settles(city, lambda: sender.is_wanted(CameraFrame, {"vehicle": "n1", "camera": "rear"}))
    assert not sender.is_wanted(CameraFrame, {"vehicle": "n2"})


def test_after_unsubscribing_nothing_more_arrives(city):
    sender, hearer = city.bus("a"), city.bus("b")
    ended, going = Mailbox(8), Mailbox(8)
    hearer.subscribe(CameraFrame, {}, ended)
    hearer.subscribe(CameraFrame, {}, going)
    settles(city, lambda: sender.is_wanted(CameraFrame, {}))
    sender.publish(picture())
    gather(city, going, 1)
    assert len(gather(city, ended, 1)) == 1
    hearer.unsubscribe(ended)
    city.pass_time(0.05)
    sender.publish(picture())
    gather(city, going, 1)
    assert ended.drain() == []


def test_message_to_another_city_comes_on_that_citys_keys_alone(city):
    here, there = city.bus("world"), city.bus("world", "other")
    own, others = Mailbox(8), Mailbox(8)
    here.subscribe(Trip, {}, own)
    there.subscribe(Trip, {}, others)
    received = gather(city, others, 1, also=lambda: here.publish(trip(), "other"))
    assert received[0].message == trip()
    assert nothing_more(city, own)


def test_call_to_another_city_is_answered_there(city):
    here, there = city.bus("world"), city.bus("world", "other")
    own, others, replies = Mailbox(8), Mailbox(8), Mailbox(8)
    here.serve(PlanRequest, {}, own)
    there.serve(PlanRequest, {}, others)
    city.pass_time(0.5)
    here.call(Call(plan(), city="other"), replies.put)
    (request,) = gather(city, others, 1)
    there.answer(Answer(request, PlanReply(junction="x1", plan="calm")))
    (reply,) = gather(city, replies, 1)
    assert reply.message == PlanReply(junction="x1", plan="calm")
    assert own.drain() == []
