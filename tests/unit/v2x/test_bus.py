"""Mailboxes: bounded, ordered among each other, lazy; and the reader behind them."""

import logging
import threading

from scm.clock import NS_PER_S, StepClock
from scm.errors import MessageError
from scm.v2x.bus import Mailbox, RawMailbox
from scm.v2x.bus_memory import MemoryNetwork
from scm.v2x.etsi.convert import cam_of
from scm.v2x.exchange import Incoming, RawSample
from scm.v2x.mailbox import drain_all
from scm.v2x.message import Refused, decode, encode
from scm.v2x.messages.cam import CamRx
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.reader import MIN_REMEMBERED, Reader

KEY = "scm/@v1/city/part/world/status"
A_STATE = VehicleState(
    vehicle="n1", t_ns=1, seq=1, x_m=1.0, y_m=2.0, yaw_rad=0.0, speed_mps=0.5, yaw_rate_radps=0.0,
    steering_rad=0.0, throttle=0.1, source="simulated",
)  # fmt: skip


def item(n):
    return Incoming(Refused(code=str(n), detail=""), n)


def test_a_mailbox_gives_back_in_order_and_forgets():
    box = Mailbox(10)
    items = [item(n) for n in range(3)]
    for i in items:
        box.put(i)
    assert box.drain() == items
    assert box.drain() == []


def test_a_full_mailbox_keeps_the_newest_and_counts_the_rest():
    box = Mailbox(2)
    for n in range(5):
        box.put(item(n))
    assert [i.t_ns for i in box.drain()] == [3, 4]
    assert box.dropped == 3


def test_unwanted_messages_take_no_room_and_wake_no_thread():
    wake = threading.Event()
    box = Mailbox(2, wake, keep=lambda one: one.t_ns == 7)
    for n in range(5):
        box.put(item(n))
    box.put_later(lambda: None)  # could not be read
    assert not wake.is_set()
    box.put(item(7))
    for n in range(5):
        box.put(item(n))
    assert wake.is_set()
    assert [i.t_ns for i in box.drain()] == [7]
    assert box.dropped == 0


def test_several_mailboxes_are_drained_in_order_of_arrival():
    a, b, raw = Mailbox(10), Mailbox(10), RawMailbox(10)
    first, second, fourth = item(1), item(2), item(4)
    third = RawSample("k", b"", None, 3)
    b.put(first)
    a.put(second)
    raw.put(third)
    b.put(fourth)
    assert drain_all([a, b, raw]) == [first, second, third, fourth]


def test_what_is_dropped_is_never_made():
    made = []

    def make(n):
        return lambda: made.append(n) or item(n)

    box = Mailbox(1)
    for n in range(3):
        box.put_later(make(n))
    assert [i.t_ns for i in box.drain()] == [2]
    assert made == [2]


def test_what_is_made_to_nothing_is_left_out():
    box = Mailbox(2)
    box.put_later(lambda: None)
    box.put(item(1))
    assert [i.t_ns for i in box.drain()] == [1]


def test_a_mailbox_wakes_its_reader():
    wake = threading.Event()
    Mailbox(1, wake).put(item(1))
    assert wake.is_set()


def test_rubbish_is_dropped_counted_and_logged_once_a_second(caplog):
    clock = StepClock()
    reader = Reader(clock)
    with caplog.at_level(logging.WARNING):
        for _ in range(100):
            assert reader.read(CityStop, "k", b"rubbish", None, 0) is None
        assert len(caplog.records) == 1
        clock.set_ns(NS_PER_S)
        reader.read(CityStop, "k", b"rubbish", None, 0)
    assert reader.rejected == 101
    assert len(caplog.records) == 2
    assert "rejected=101" in caplog.text


def test_a_message_that_claims_to_be_from_somebody_else_is_dropped():
    reader = Reader(StepClock())
    honest, forged = (encode(PartStatus(station=s, t_ns=0))[0] for s in ("world", "eye"))
    assert reader.read(PartStatus, KEY, honest, None, 5).t_ns == 5
    assert reader.read(PartStatus, KEY, forged, None, 5) is None
    assert reader.rejected == 1


def heard_by(receiver, key_of=None, **facts):
    """Return what a reader takes: the CAM of one car, as it reaches a receiver."""
    cam = cam_of(A_STATE, length_m=0.5, width_m=0.2, front_m=0.4)
    copy = CamRx(**{"receiver": receiver, "station": "n1", "t_ns": 1, "body": cam} | facts)
    return CamRx, f"scm/@v1/city/v2x/rx/{key_of or receiver}/n1/cam", encode(copy)[0], None, 5


def test_of_copies_the_first_alone_is_read():
    reader = Reader(StepClock())
    assert reader.read_once(*heard_by("a")).message.receiver == "a"
    assert reader.read_once(*heard_by("b")) is None
    assert reader.read(*heard_by("b")).message.receiver == "b"
    assert reader.read_once(*heard_by("b", t_ns=2)).message.t_ns == 2
    assert reader.read_once(*heard_by("b", signed="another")).message.signed == "another"
    assert reader.rejected == 0


def test_a_copy_with_a_false_receiver_is_rejected():
    reader = Reader(StepClock())
    assert reader.read_once(*heard_by("a")) is not None
    assert reader.read_once(*heard_by("a", key_of="b")) is None
    assert reader.rejected == 1


def test_what_is_not_believed_keeps_no_copy_from_being_read():
    def check(message, t_ns):
        if message.receiver == "a":
            msg = "not signed"
            raise MessageError(msg)

    reader = Reader(StepClock(), check)
    assert reader.read_once(*heard_by("a")) is None
    assert reader.read_once(*heard_by("b")).message.receiver == "b"


def test_old_copies_are_forgotten():
    reader = Reader(StepClock())
    for t_ns in range(2 * MIN_REMEMBERED + 1):
        assert reader.read_once(*heard_by("a", t_ns=t_ns)) is not None
    assert reader.read_once(*heard_by("b", t_ns=2 * MIN_REMEMBERED)) is None
    assert reader.read_once(*heard_by("b", t_ns=0)) is not None


def test_a_subscription_can_receive_each_frame_once():
    network = MemoryNetwork(StepClock())
    with network.bus("city", "world") as world, network.bus("city", "ear") as ear:
        once, every = Mailbox(10, once=True), Mailbox(10)
        for box in (once, every):
            ear.subscribe(CamRx, {}, box)
        for receiver in "abc":
            kind, _, body, _, _ = heard_by(receiver)
            world.publish(decode(kind, body))
        assert [item.message.receiver for item in once.drain()] == ["a"]
        assert [item.message.receiver for item in every.drain()] == ["a", "b", "c"]
