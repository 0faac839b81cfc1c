"""What the city itself knows excuses honest cars: newcomers, bare roofs, hands, stops; no liar."""

import math

import pytest

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.check import HARD_DRIVING_S, NEWCOMER_S, Sender, load_checks
from scm.traffic.misbehaviour.detector import Detector
from scm.traffic.misbehaviour.fusion import MAX_UNSEEN_SCORE
from scm.traffic.misbehaviour.limits import Limits, limits_of
from tests.unit.traffic.misbehaviour.claims import RSU, body, ground, state, track

NIGEL, HAND, STOPPED = Sender("nigel"), Sender("nigel", by_hand=True), Sender("nigel", stopped=True)
CHECKS = [check for check in load_checks() if check.name != "beacon_frequency"]
"""All but the rule of when to speak: cars speak ten times a second here, whatever they do."""
BARE = limits_of(0.267, 0.767, has_tag=False)


def detector():
    return Detector(ground(), lambda car: BARE if car == "bare" else Limits(), CHECKS)


def receive(judge, told, sender):
    return judge.receive(told.vehicle, RSU, told.t_ns, body(told), 0, sender)


def drive(judge, sender, seconds=20, name="n1", shift=(0.0, 0.0), tag=None, v=0.0):
    """Let a car speak ten times a second while the Eye sees another one; return the last judged."""
    for k in range(10 * seconds):
        judge.see(track(state(0.1 * k, 0.9, v=0.0, name="n2")))
        told = state(0.1 * k, 0.1 + 0.002 * (k % 2), v=v, name=name, shift=shift)
        if tag is not None and tag(0.1 * k):
            judge.see(track(told))
        found = receive(judge, told, sender)
    return found.history


def harder(judge, sender, hard_until_s=9.0, from_s=4.0):
    """Let a car brake and speed up as only hands do, each time within a tenth of a second."""
    place, points, speed = 0.05, 0.0, 0.02
    for k in range(90):
        t_s, before = 0.1 * k, speed
        fast = t_s >= from_s and k % 4 in (1, 2)
        speed, accel = (0.2, 0.2) if fast else (0.02, -0.2)
        place += 0.05 * (speed + before)
        known = sender if t_s < hard_until_s else NIGEL
        told = state(t_s, place, v=speed, a=accel)
        points = max(points, receive(judge, told, known).history.score)
    return points


@pytest.mark.parametrize("car", ["nigel", "bare"])
def test_a_car_of_the_city_whose_tag_the_eye_never_saw_is_not_suspected_but_said_to_be_unseen(car):
    history = drive(detector(), Sender(car), v=0.02)
    assert "eye_missing" not in history.noted
    assert history.is_tag_unseen


def test_a_ghost_is_still_one_where_the_city_knows_no_such_car():
    history = drive(detector(), Sender(), v=0.02)
    assert "eye_missing" in history.noted
    assert not history.is_tag_unseen


def test_who_hides_his_tag_after_it_was_seen_is_missed():
    history = drive(detector(), NIGEL, tag=lambda t_s: t_s < 5.0, v=0.02)
    assert "eye_missing" in history.noted
    assert not history.is_tag_unseen


def test_the_eye_that_sees_a_tag_says_nothing():
    assert not drive(detector(), NIGEL, tag=lambda _t: True, v=0.02).is_tag_unseen


def test_a_newcomer_beside_the_road_has_seconds_of_grace_and_no_more():
    def until_s(sender):
        judge = detector()
        for k in range(100):
            told = state(0.1 * k, 0.1, v=0.0, shift=(-0.3, -0.6))
            if receive(judge, told, sender).history.since_ns is not None:
                return 0.1 * k
        return None

    assert until_s(Sender()) < 0.5
    assert NEWCOMER_S < until_s(NIGEL) < NEWCOMER_S + 1.0


def against_its_lane(judge, sender, jumps=False):
    """Let a car drive against its lane while the Eye sees another one; return what is known."""
    for k in range(100):
        judge.see(track(state(0.1 * k, 0.9, v=0.0, name="n2")))
        told = state(0.1 * k, 0.6 - 0.003 * k, v=0.03, turn=math.pi)
        if jumps and k == 99:
            told = state(0.1 * k, 0.1, v=0.03, turn=math.pi)
        history = receive(judge, told, sender).history
    return history


def test_who_cannot_be_seen_is_not_suspected_for_driving_badly_alone():
    """No Eye could speak for it, as it would for a car with a tag; a contradiction still counts."""
    assert against_its_lane(detector(), Sender()).since_ns is not None
    history = against_its_lane(detector(), NIGEL)
    assert (history.since_ns, history.is_tag_unseen) == (None, True)
    assert 2.0 < history.score <= MAX_UNSEEN_SCORE
    assert against_its_lane(detector(), NIGEL, jumps=True).since_ns is not None


@pytest.mark.parametrize("name", ["n1", "n9"])
def test_grace_hides_no_contradiction(name):
    """Who jumps about, or uses another car's number, is found in its first second."""
    judge, found = detector(), None
    for k in range(6):
        told = state(0.15 * k, 0.1, shift=(0.9 * (k % 2), 0.0))
        sent = body(told)
        found = judge.receive(name, RSU, told.t_ns, sent, 0, NIGEL)
    assert found.history.since_ns is not None


def test_hands_and_stops_move_a_car_as_no_driver_does():
    assert harder(detector(), NIGEL) > 5.0 * harder(detector(), HAND)
    assert harder(detector(), NIGEL) > 5.0 * harder(detector(), STOPPED)


def test_leniency_ends_soon_after_hands_let_go():
    """It goes by what the world writes into each CAM: a car that says so itself gains nothing."""
    late = harder(detector(), HAND, hard_until_s=1.0, from_s=1.0 + HARD_DRIVING_S + 0.5)
    assert late == pytest.approx(
        harder(detector(), NIGEL, from_s=1.0 + HARD_DRIVING_S + 0.5), rel=0.1
    )


@pytest.mark.parametrize("sender", [HAND, STOPPED])
@pytest.mark.parametrize("lie", [{"shift": (1.5, -1.5)}, {"v": 0.9}])
def test_who_lies_by_hand_or_in_a_stop_is_found_all_the_same(sender, lie):
    judge = detector()
    for k in range(60):
        told = state(0.1 * k, 0.1 + 0.02 * k)
        judge.see(track(told))
        said = told if k < 30 else state(0.1 * k, 0.1 + 0.02 * k, **lie)
        history = receive(judge, said, sender).history
    assert history.since_ns is not None
    assert history.since_ns - told.t_ns > -3 * NS_PER_S


@pytest.mark.parametrize("touches", [True, False])
def test_who_scrapes_along_a_wall_tells_a_speed_that_is_no_way(touches):
    """Its wheels turn and a wall holds it, so place and speed contradict each other in truth."""
    judge = detector()
    for k in range(80):
        told = state(0.1 * k, 0.1 + 0.003 * k, v=0.08)
        history = receive(judge, told, Sender("nigel", touches=touches)).history
    assert (history.since_ns is None) == touches


def test_a_faster_car_is_judged_by_what_it_can_do():
    fast = limits_of(2.67, 0.767, has_tag=True)
    judge = Detector(ground(), lambda _car: fast, CHECKS)
    for k in range(9):
        told = state(0.1 * k, 0.05 + 0.1 * k, v=1.0)
        found = receive(judge, told, Sender("fast"))
    assert found.history.score < 1.0
    assert fast.accel_mps2 == pytest.approx(9.0)


def test_a_faster_car_file_buys_no_leniency_at_the_speed_of_others():
    """What is excused goes by the speed that is driven, so a Nigel's lie is found in any car."""
    judge = Detector(ground(), lambda _car: limits_of(7.0, 0.767, has_tag=False), CHECKS)
    for k in range(60):
        history = receive(judge, state(0.1 * k, 0.05 + 0.01 * k, v=0.2), Sender("dart")).history
    assert history.since_ns is not None
    assert "position_speed_consistency" in history.noted
