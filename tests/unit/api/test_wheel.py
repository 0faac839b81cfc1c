"""The rules of a wheel in far hands: dead-man, silence, order, renewal."""

import math

import pytest

from scm.api.wheel import RENEW_NS, Wheel
from scm.clock import NS_PER_MS, NS_PER_S
from scm.records.drive import DrivePacket

T0 = 1_000 * NS_PER_MS
SILENT_NS, GONE_NS = 250 * NS_PER_MS, 5 * NS_PER_S


@pytest.fixture
def wheel():
    return Wheel("n1", "anna #1", 7, T0)


def packet(seq=1, throttle=0.5, steering=0.25, held=True):
    return DrivePacket(seq=seq, t_ms=1.0, held=held, throttle=throttle, steering=steering)


def test_before_the_first_packet_the_car_stands(wheel):
    assert wheel.command(T0).throttle == 0.0
    assert wheel.why(T0) == "released"


def test_a_held_key_drives_under_the_lease(wheel):
    assert wheel.receive(packet(), T0)
    command = wheel.command(T0)
    assert (command.vehicle, command.epoch) == ("n1", 7)
    assert (command.throttle, command.steering) == (0.5, 0.25)


def test_letting_go_stops_at_once_and_holds_the_steering(wheel):
    wheel.receive(packet(seq=1), T0)
    wheel.receive(packet(seq=2, held=False), T0)
    command = wheel.command(T0)
    assert (command.throttle, command.steering) == (0.0, 0.25)
    assert wheel.why(T0) == "released"


def test_silence_of_250_ms_stops_though_the_key_was_held(wheel):
    wheel.receive(packet(), T0)
    assert wheel.command(T0 + SILENT_NS - 1).throttle == 0.5
    assert wheel.command(T0 + SILENT_NS).throttle == 0.0
    assert wheel.why(T0 + SILENT_NS) == "silent"


def test_after_five_silent_seconds_nobody_is_there(wheel):
    wheel.receive(packet(), T0)
    assert not wheel.is_abandoned(T0 + GONE_NS - 1)
    assert wheel.is_abandoned(T0 + GONE_NS)


@pytest.mark.parametrize("seq", [4, 5])
def test_an_old_or_repeated_packet_neither_drives_nor_keeps_the_hand_on(wheel, seq):
    wheel.receive(packet(seq=5, throttle=0.1), T0)
    assert not wheel.receive(packet(seq=seq, throttle=0.9), T0 + SILENT_NS)
    assert wheel.why(T0 + SILENT_NS) == "silent"


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_what_is_no_number_is_refused(wheel, wrong):
    assert not wheel.receive(packet(throttle=wrong), T0)
    assert not wheel.receive(packet(steering=wrong), T0)
    assert wheel.newest is None


def test_no_packet_asks_for_more_than_all(wheel):
    wheel.receive(packet(throttle=-9.0, steering=9.0), T0)
    command = wheel.command(T0)
    assert (command.throttle, command.steering) == (-1.0, 1.0)


def test_commands_count_up(wheel):
    assert [wheel.command(T0).seq for _ in range(3)] == [1, 2, 3]


def test_the_lease_is_renewed_three_times_in_its_life(wheel):
    assert wheel.renewal(T0) is None
    request = wheel.renewal(T0 + RENEW_NS)
    assert (request.verb, request.owner, request.epoch) == ("renew", "anna #1", 7)
    assert wheel.renewal(T0 + RENEW_NS) is None
    assert request.ttl_ms * NS_PER_MS > 3 * RENEW_NS
