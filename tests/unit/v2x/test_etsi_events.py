"""Warnings: new, repeated, updated, ended, believed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MessageError
from scm.v2x.etsi.convert import place_of
from scm.v2x.etsi.denm import CANCELLATION, NEGATION
from scm.v2x.etsi.events import (
    ACCIDENT,
    DANGEROUS_SITUATION,
    STATIONARY_VEHICLE,
    CarWarnings,
    DenmReceiver,
    DenmSender,
    Event,
)
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.vehicle_state import VehicleState

NOW = 1_800_000_000 * NS_PER_S
EVENT = Event(cause=ACCIDENT, x_m=1.0, y_m=0.5, valid_s=10, interval_ms=500)


def state(t_ns, mode="drive", speed_mps=0.0, accel_mps2=0.0):
    return VehicleState(
        vehicle="n1", t_ns=t_ns, seq=0, x_m=1.0, y_m=0.5, yaw_rad=0.0, speed_mps=speed_mps,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, source="simulated", mode=mode,
        accel_mps2=accel_mps2,
    )  # fmt: skip


def hit(t_ns, *against):
    return Contact(
        vehicle="n1", t_ns=t_ns, dvx_mps=0.0, dvy_mps=0.0, dyaw_rate_radps=0.0, against=against
    )


def test_a_warning_is_repeated_unchanged_until_it_is_no_longer_valid():
    sender = DenmSender("n1")
    sender.trigger(EVENT, NOW)
    sent = [b for ms in range(0, 20_000, 100) for b in sender.due(NOW + ms * NS_PER_MS)]
    assert len(sent) == 20
    assert len(set(map(repr, sent))) == 1
    position = sent[0].management_container.event_position
    assert place_of(position.latitude, position.longitude) == pytest.approx((1.0, 0.5), abs=1e-3)


def test_an_update_keeps_the_name_and_has_a_later_reference_time_even_at_once():
    sender = DenmSender("n1")
    action = sender.trigger(EVENT, NOW)
    (first,) = sender.due(NOW)
    sender.update(action, EVENT, NOW)
    (second,) = sender.due(NOW)
    before, after = first.management_container, second.management_container
    assert before.action_id == after.action_id == action
    assert after.reference_time > before.reference_time


def test_two_events_of_a_station_have_two_names():
    sender = DenmSender("n1", first=65_535)
    names = {sender.trigger(EVENT, NOW).sequence_number for _ in range(2)}
    assert names == {65_535, 0}


def test_an_ended_event_cannot_be_updated():
    sender = DenmSender("n1")
    action = sender.trigger(EVENT, NOW)
    sender.cancel(action, NOW + NS_PER_S)
    with pytest.raises(MessageError, match="still lasts"):
        sender.update(action, EVENT, NOW + NS_PER_S)
    (ended,) = sender.due(NOW + NS_PER_S)
    assert ended.management_container.termination == CANCELLATION
    assert ended.situation_container is None


def test_a_receiver_follows_an_event_from_beginning_to_end():
    sender, watch = DenmSender("n1"), DenmReceiver()
    action = sender.trigger(EVENT, NOW)
    (first,) = sender.due(NOW)
    assert watch.receive(first, NOW) == "new"
    assert watch.receive(first, NOW + NS_PER_S) == "repetition"
    sender.update(action, EVENT, NOW + NS_PER_S)
    (second,) = sender.due(NOW + NS_PER_S)
    assert watch.receive(second, NOW + NS_PER_S) == "update"
    assert watch.receive(first, NOW + NS_PER_S) == "ignored"
    assert watch.events(NOW + NS_PER_S) == (second,)
    sender.cancel(action, NOW + 2 * NS_PER_S)
    (ended,) = sender.due(NOW + 2 * NS_PER_S)
    assert watch.receive(ended, NOW + 2 * NS_PER_S) == "ended"
    assert watch.receive(second, NOW + 2 * NS_PER_S) == "ignored"
    assert watch.events(NOW + 2 * NS_PER_S) == ()


def test_an_event_without_repetition_expires():
    sender, watch = DenmSender("n1"), DenmReceiver()
    sender.trigger(EVENT, NOW)
    (body,) = sender.due(NOW)
    late = NOW + 4 * NS_PER_S
    assert watch.receive(body, late) == "new"
    assert watch.events(NOW + 10 * NS_PER_S - 2 * NS_PER_MS) == (body,)
    assert watch.events(NOW + 10 * NS_PER_S + NS_PER_MS) == ()
    assert watch.receive(body, NOW + 11 * NS_PER_S) == "ignored"


def test_another_station_may_deny_what_the_receiver_knows_and_nothing_else():
    sender, other = DenmSender("n1"), DenmSender("rsu-crossing", 15)
    sender.trigger(EVENT, NOW)
    (body,) = sender.due(NOW)
    other.negate(body, NOW + NS_PER_S)
    (denial,) = other.due(NOW + NS_PER_S)
    assert denial.management_container.termination == NEGATION
    stranger, watch = DenmReceiver(), DenmReceiver()
    assert stranger.receive(denial, NOW + NS_PER_S) == "ignored"
    watch.receive(body, NOW)
    assert watch.receive(denial, NOW + NS_PER_S) == "ended"


def test_a_station_cannot_update_another_stations_event():
    sender = DenmSender("n1")
    sender.trigger(EVENT, NOW)
    (body,) = sender.due(NOW)
    forged = type(body)(
        protocol_version=2,
        station_id=body.station_id + 1,
        management_container=body.management_container,
    )
    assert DenmReceiver().receive(forged, NOW) == "ignored"


@given(order=st.permutations(range(4)))
def test_the_newest_word_wins_in_whatever_order_it_comes(order):
    sender, watch = DenmSender("n1"), DenmReceiver()
    action = sender.trigger(EVENT, NOW)
    said = sender.due(NOW)
    for step in (1, 2, 3):
        sender.update(action, EVENT._replace(x_m=float(step)), NOW + step * NS_PER_S)
        said += sender.due(NOW + step * NS_PER_S)
    for number in order:
        watch.receive(said[number], NOW + 4 * NS_PER_S)
    assert watch.events(NOW + 4 * NS_PER_S) == (said[3],)


def test_a_hit_car_warns_once_of_many_contacts():
    warnings = CarWarnings("n1")
    sent = [
        body
        for ms in range(0, 900, 20)
        for body in warnings.step(state(NOW + ms * NS_PER_MS), (hit(NOW, "n2"),))
    ]
    (body,) = sent
    cause = body.situation_container.event_type
    assert (cause.cause, cause.subcause) == (ACCIDENT, 1)


@pytest.mark.parametrize(("mode", "warns"), [("drive", False), ("hold", True), ("stop", True)])
def test_a_car_warns_of_itself_while_its_guard_keeps_it_standing(mode, warns):
    car, watch = CarWarnings("n1"), DenmReceiver()
    for ms in range(0, 60_000, 100):
        now = NOW + ms * NS_PER_MS
        for body in car.step(state(now, mode)):
            watch.receive(body, now)
    causes = [b.situation_container.event_type.cause for b in watch.events(now)]
    assert causes == ([STATIONARY_VEHICLE] if warns else [])
    (*ended,) = car.step(state(now + NS_PER_S, "drive", 0.2))
    assert [watch.receive(body, now + NS_PER_S) for body in ended] == (["ended"] if warns else [])


def braking(accels, speed_mps=0.2, contacts=()):
    warnings, sent = CarWarnings("n1"), []
    for step, accel in enumerate(accels):
        t_ns = NOW + step * 100 * NS_PER_MS
        sent += warnings.step(state(t_ns, "drive", speed_mps, accel), contacts)
        contacts = ()
    return sent


def test_hard_braking_is_one_event_and_comfortable_braking_none():
    assert braking([-1.2] * 20) == [], "as hard as a Nigel stops for a light"
    assert braking([-2.7] * 20, speed_mps=0.01) == []
    sent = braking([-2.7] * 30)
    causes = {(e.cause, e.subcause) for e in (b.situation_container.event_type for b in sent)}
    assert causes == {(DANGEROUS_SITUATION, 1)}
    assert len({b.management_container.action_id for b in sent}) == 1
    assert len(sent) == 20, "ten times a second while it is valid"


def test_a_car_that_was_hit_sends_no_braking_warning():
    sent = braking([-9.0] * 20, contacts=(hit(NOW, "n2"),))
    assert {b.situation_container.event_type.cause for b in sent} == {ACCIDENT}


def test_the_caller_decides_where_stopping_is_not_allowed():
    for is_stranded, mode in ((True, "drive"), (False, "stop")):
        car = CarWarnings("n1")
        sent = [
            body
            for ms in range(0, 4000, 100)
            for body in car.step(state(NOW + ms * NS_PER_MS, mode), is_stranded=is_stranded)
        ]
        assert bool(sent) == car.is_busy == is_stranded
