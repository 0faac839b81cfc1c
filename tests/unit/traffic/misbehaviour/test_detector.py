"""What claims add up to: memory, hysteresis, witnesses, and what cannot be helped."""

import random

import pytest

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour import fusion
from scm.traffic.misbehaviour.check import load_checks
from scm.traffic.misbehaviour.fusion import StationHistory
from scm.traffic.misbehaviour.kalman import Kalman
from tests.unit.traffic.misbehaviour.claims import START_NS, detector, receive, state, track

CHECK = load_checks()[0]


def claim_at(judge, t_s):
    return receive(judge, state(t_s, 0.3, v=0.0)).claim


def test_a_cam_heard_at_two_roadside_units_counts_once():
    judge = detector()
    assert receive(judge, state(0.0, 0.3)) is not None
    assert receive(judge, state(0.0, 0.3), receiver="rsu-other") is None
    assert judge.claims_checked == 1


def test_an_honest_car_is_never_suspected():
    judge = detector()
    for k in range(8):
        told = state(0.8 * k, 0.05 + 0.16 * k)
        judge.see(track(told))
        judged = receive(judge, told)
        assert judged.history.score < 1.0, judged.findings
        assert not judged.is_reported


def test_a_car_whose_place_the_eye_denies_is_reported_within_two_claims():
    judge = detector()
    reported = []
    for k in range(3):
        told = state(0.4 * k, 0.05 + 0.08 * k)
        judge.see(track(told))
        lie = state(0.4 * k, 0.05 + 0.08 * k, shift=(1.5, -1.5))
        reported.append(receive(judge, lie).is_reported)
    assert reported == [False, True, False]


def test_a_silent_car_is_no_misbehaviour():
    judge = detector()
    for k in range(20):
        judge.see(track(state(0.1 * k, 0.3, name="n7")))
    judge.forget(START_NS + 3 * NS_PER_S)
    assert judge.histories == {}


def test_the_eye_speaks_for_a_car_beside_the_road():
    with_eye, without = detector(), detector()
    for k in range(4):
        told = state(1.0 * k, 0.1, v=0.0, shift=(-0.3, -0.6))
        with_eye.see(track(told))
        seen, unseen = receive(with_eye, told), receive(without, told)
    assert seen.history.score < 1.0
    assert unseen.history.since_ns is not None


def test_suspicion_comes_at_one_score_and_goes_at_a_lower_one():
    judge, history = detector(), StationHistory("n1", START_NS)
    times = iter(range(1000))
    blatant, gap_s = [(CHECK, 1e-9)], 1.0
    told = [history.add(claim_at(judge, next(times)), gap_s, blatant) for _ in range(2)]
    assert told == [False, True]
    while history.score >= fusion.SUSPECTED_FROM:
        history.add(claim_at(judge, next(times)), gap_s, [])
    assert history.since_ns is not None
    while history.score >= fusion.CLEARED_BELOW:
        history.add(claim_at(judge, next(times)), gap_s, [])
    assert history.since_ns is None
    assert history.noted == {}


def test_while_it_lasts_it_is_told_every_ten_seconds():
    judge, history = detector(), StationHistory("n1", START_NS)
    told = [history.add(claim_at(judge, k), 1.0, [(CHECK, 1e-9)]) for k in range(24)]
    assert [k for k, was in enumerate(told) if was] == [1, 11, 21]


def test_evidence_holds_each_doubtful_claim_and_the_one_before_it():
    judge = detector()
    honest = [receive(judge, state(0.4 * k, 0.05 + 0.08 * k)).claim for k in range(4)]
    found = receive(judge, state(1.6, 0.3, shift=(2.0, 2.0)))
    assert list(found.history.evidence) == [honest[-1], found.claim]


@pytest.mark.parametrize("seed", range(3))
def test_whatever_the_fields_hold_it_answers(seed):
    from scm.traffic.misbehaviour.forge import driven, moved, stamped
    from tests.unit.traffic.misbehaviour.claims import RSU, body

    rng, judge = random.Random(seed), detector()
    for k in range(300):
        told = moved(body(state(0.1, 0.1)), rng.uniform(-1e4, 1e4), rng.uniform(-1e4, 1e4))
        told = driven(
            told, speed_mps=rng.uniform(-99.0, 99.0), yaw_rad=rng.uniform(-9.0, 9.0),
            accel_mps2=rng.uniform(-99.0, 99.0),
        )  # fmt: skip
        t_ns = START_NS + rng.randrange(100) * NS_PER_S
        told = stamped(told, rng.randrange(10**19), rng.choice((None, 5, 7)))
        judged = judge.receive(f"n{rng.randrange(3)}", RSU, t_ns + k, told)
        assert judged is None or 0.0 <= judged.history.score < 1e3


def test_the_filter_follows_a_steady_car_and_notes_a_jump():
    kalman = Kalman()
    kalman.begin(0.0, 0.0, 0.2, 0.0)
    for k in range(1, 20):
        kalman.update(0.1, 0.02 * k, 0.0, 0.2, 0.0, 0.005, 0.005)
        assert kalman.moved_m < 1e-6
    kalman.update(0.1, 0.4 + 0.3, 0.0, 0.2, 0.0, 0.005, 0.005)
    assert kalman.moved_m == pytest.approx(0.3, abs=1e-6)
    assert kalman.position_std < 0.02
