"""Bytes at the wrong speed, and the faults of a cheap cable."""

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from vehicle_agent.emulate.faults import Event, FaultInjector, Faults, read_faults
from vehicle_agent.emulate.uart import received_bytes
from vehicle_agent.nigel.rosserial import REQUEST_TOPICS, Decoder, pack

FRAME = pack(REQUEST_TOPICS)


def test_the_right_speed_changes_nothing():
    assert received_bytes(FRAME, 57600, 57600) == FRAME


def test_a_little_off_is_still_understood():
    assert received_bytes(FRAME, 57600, 58800) == FRAME  # a ceramic resonator's 2 %


@pytest.mark.parametrize(("sent", "read"), [(115200, 57600), (57600, 115200), (9600, 57600)])
def test_the_wrong_speed_gives_bytes_but_no_frame(sent, read):
    got = received_bytes(FRAME * 20, sent, read)
    assert got
    assert Decoder().feed(got, 0) == []


def test_twice_the_speed_sees_each_bit_twice():
    # On the line: 0 | 1 0 1 0 1 0 1 0 | 1. The start bit is taken for two of them, then four of
    # the others; the fifth edge begins a second byte.
    assert received_bytes(b"\x55", 57600, 115200) == bytes([0b01100110, 0b11100110])


def test_bits_too_short_for_a_start_are_none():
    assert received_bytes(b"\xff", 400_000, 57600) == b""


def test_a_plan_is_read_in_the_order_of_its_times():
    plan = read_faults(["flip=0.01", "reset@12", "unplug@5:2", "brownout@8"])
    assert plan.rates == {"flip": 0.01}
    assert plan.events == (Event(5.0, "unplug", 2.0), Event(8.0, "brownout"), Event(12.0, "reset"))


@pytest.mark.parametrize(
    "word", ["flop=0.1", "flip", "flip=x", "flip=2", "reset@", "reset@3:4", "noise@3", "cut=-1",
             "lose=nan", "unplug@5:"],
)  # fmt: skip
def test_words_that_are_no_fault_are_refused(word):
    if word == "unplug@5:":
        assert read_faults([word]).events == (Event(5.0, "unplug"),)
        return
    with pytest.raises(RunError, match=f"--faults {word}: expected"):
        read_faults([word])


def happened(injector, until_s):
    return [
        (event.kind, ms)
        for ms in range(0, 1000 * until_s, 10)
        for event in injector.due(ms * NS_PER_MS)[0]
    ]


def test_planned_events_happen_once_at_their_time():
    injector = FaultInjector(read_faults(["reset@1", "brownout@2.5"]), 0, 0)
    assert happened(injector, 5) == [("reset", 1000), ("brownout", 2500)]


def test_random_events_come_at_their_rate_and_the_same_for_a_seed():
    plan = read_faults(["reset=0.5", "noise=20"])
    runs = [happened(FaultInjector(plan, seed, 0), 400) for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]
    assert 150 < len(runs[0]) < 250
    noise = sum(len(FaultInjector(plan, seed, 0).due(10 * NS_PER_S)[1]) for seed in range(10))
    assert 1800 < noise < 2200


def test_bytes_are_lost_flipped_and_cut_at_their_rates():
    sent = bytes(range(256)) * 40
    lost = FaultInjector(Faults({"lose": 0.1}), 3, 0).corrupt(sent)
    assert 0.88 < len(lost) / len(sent) < 0.92
    flipped = FaultInjector(Faults({"flip": 0.1}), 3, 0).corrupt(sent)
    changed = [a ^ b for a, b in zip(flipped, sent, strict=True) if a != b]
    assert 0.08 < len(changed) / len(sent) < 0.12
    assert all(change.bit_count() == 1 for change in changed)
    injector = FaultInjector(Faults({"cut": 0.25}), 3, 0)
    pieces = [injector.corrupt(FRAME) for _ in range(400)]
    assert 60 < sum(len(piece) < len(FRAME) for piece in pieces) < 140
    assert all(FRAME.startswith(piece) for piece in pieces)


def test_without_faults_all_arrives():
    assert FaultInjector(Faults(), 0, 0).corrupt(FRAME) == FRAME
