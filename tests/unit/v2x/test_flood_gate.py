"""The flood gate: one loud key is cut, and nobody else is."""

import threading

import pytest
import zenoh

from scm.clock import NS_PER_S, WallClock, seconds
from scm.v2x import zenoh_config
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.exchange import Answer, Call
from scm.v2x.flood_gate import BYTES_A_SECOND, MESSAGES_A_SECOND, FloodGate
from scm.v2x.message import encode
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.router import Router, free_endpoint
from scm.v2x.zenoh_config import LARGEST_BYTES

KEY = "scm/@v1/city/v/n1/@camera/front"
CLOCK, NEVER = WallClock(), threading.Event()
PATIENCE_S = 30.0

pytestmark = pytest.mark.usefixtures("lasting_links")


def test_a_loud_key_is_cut_at_its_limit_and_others_are_not():
    gate = FloodGate()
    admitted = sum(gate.admits("loud", 10, i) for i in range(3 * MESSAGES_A_SECOND))
    assert (admitted, gate.dropped) == (MESSAGES_A_SECOND, 2 * MESSAGES_A_SECOND)
    assert gate.admits("quiet", 10, 1)


def filled(now_ns):
    gate = FloodGate()
    for _ in range(MESSAGES_A_SECOND):
        gate.admits("loud", 10, now_ns)
    return gate


def test_a_limited_key_is_read_again_a_second_later():
    gate = filled(0)
    assert not gate.admits("loud", 10, NS_PER_S - 1)
    assert gate.admits("loud", 10, NS_PER_S)


@pytest.mark.parametrize("jump_s", [-3600, 3600])
def test_a_clock_jump_blocks_no_key(jump_s):
    gate = filled(5000 * NS_PER_S)
    assert not gate.admits("loud", 10, 5000 * NS_PER_S)
    assert gate.admits("loud", 10, (5000 + jump_s) * NS_PER_S)


def test_few_huge_messages_are_a_flood_too():
    gate = FloodGate()
    size = BYTES_A_SECOND // 4
    assert [gate.admits("loud", size, 0) for _ in range(6)] == [True] * 4 + [False] * 2


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def buses(endpoint):
    with (
        Router(endpoint),
        ZenohBus("city", "ears", endpoint) as ears,
        ZenohBus("city", "mouth", endpoint) as mouth,
    ):
        yield ears, mouth


def wait_for(condition):
    end_ns = CLOCK.now_ns() + round(PATIENCE_S * NS_PER_S)
    while not condition():
        assert CLOCK.now_ns() < end_ns
        NEVER.wait(0.005)


def status(station, number=0):
    return PartStatus(station=station, t_ns=number)


def test_a_reader_of_a_flooded_key_still_receives_the_others(buses):
    ears, mouth = buses
    box, heard = Mailbox(100_000), []

    def look():
        heard.extend(item.message.station for item in box.drain())
        return heard

    def say_both():
        for i in range(500):
            mouth.publish(status("loud", i))
        mouth.publish(status("quiet"))

    ears.subscribe(PartStatus, {}, box)
    wait_for(lambda: mouth.publish(status("quiet")) or look())
    wait_for(lambda: say_both() or ears.rejected > 0)
    del heard[:]
    began_ns = CLOCK.now_ns()
    wait_for(lambda: say_both() or "quiet" in look())
    took_s = seconds(CLOCK.now_ns() - began_ns)
    assert heard.count("loud") <= (2 + took_s) * MESSAGES_A_SECOND


def test_a_flood_of_requests_is_cut_and_a_second_later_one_is_answered(buses):
    ears, mouth = buses
    box, replies = Mailbox(100_000), []
    ears.serve(StopRequest, {}, box)

    def answer():
        for item in box.drain():
            ears.answer(Answer(item, CityStop(t_ns=1, engaged=False)))

    def ask():
        call = Call(StopRequest(engaged=False, by="me"), 1.0)
        mouth.call(call, lambda item: replies.append(item.message))

    def flood():
        for _ in range(200):
            ask()
        answer()

    wait_for(lambda: flood() or ears.rejected > 0)
    wait_for(lambda: answer() or ask() or any(isinstance(one, CityStop) for one in replies[-5:]))


def frame(size):
    return CameraFrame(
        vehicle="n1", camera="front", t_ns=size, width_px=1, height_px=1, payload=bytes(size)
    )


def test_an_oversized_message_is_dropped_and_the_city_continues(buses, endpoint):
    ears, mouth = buses
    statuses, frames = Mailbox(100), Mailbox(100)
    ears.subscribe(PartStatus, {}, statuses)
    ears.subscribe(CameraFrame, {}, frames)

    def show(size):
        mouth.publish(frame(size))

    wait_for(lambda: show(1_000_000) or frames.drain())
    with zenoh.open(zenoh.Config.from_json5(zenoh_config.client(endpoint, PATIENCE_S))) as huge:
        body, header = encode(frame(LARGEST_BYTES + 1_000_000))
        blocks = zenoh.CongestionControl.BLOCK
        huge.put(KEY, body, attachment=header, congestion_control=blocks)
        NEVER.wait(0.5)
    wait_for(lambda: mouth.publish(status("after")) or statuses.drain())
    sizes = []

    def look():
        show(2_000_000)
        sizes.extend(item.message.t_ns for item in frames.drain())
        return 2_000_000 in sizes

    wait_for(look)
    assert max(sizes) <= LARGEST_BYTES
