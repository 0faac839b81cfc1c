"""What lateness makes of honest claims: no check accuses by it, and none excuses more than it."""

import math

import pytest

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.check import load_checks
from scm.traffic.misbehaviour.detector import seen_ns
from tests.unit.traffic.misbehaviour.claims import detector, receive, state, track

CHECKS = {check.name: check for check in load_checks()}
SPEED_MPS, LOST_S = 0.2, 0.4
EYE_DENIES = {
    "eye_position": {"shift": (0.2, 0.0)},
    "eye_speed": {"v": 0.05},
    "eye_heading": {"turn": 0.5},
}


def starved(judge, told_s, missed_s=LOST_S, seconds=12):
    """Let a car drive that stands still for `missed_s` of each second and tells of `told_s`."""
    found = []
    for k in range(seconds):
        way_m = 0.05 + SPEED_MPS * (1.0 - missed_s) * k
        found += receive(judge, state(1.0 * k, way_m, v=SPEED_MPS), lost_s=told_s * k).findings
    return found


@pytest.mark.parametrize("checks", [(), (CHECKS["position_speed_consistency"],)])
def test_a_car_whose_computer_was_too_slow_has_not_lied_about_its_way(checks):
    assert starved(detector(*checks), LOST_S) == []


def test_the_same_way_without_lost_time_is_a_lie():
    assert starved(detector(CHECKS["position_speed_consistency"]), 0.0)


def test_lost_time_excuses_no_more_than_itself():
    assert starved(detector(CHECKS["position_speed_consistency"]), 0.1)


def test_lost_time_that_made_no_difference_accuses_nobody():
    assert starved(detector(), LOST_S, missed_s=0.0, seconds=6) == []


def test_lost_time_does_not_excuse_a_way_longer_than_the_speeds():
    judge, found = detector(CHECKS["position_speed_consistency"]), []
    for k in range(6):
        found += receive(judge, state(1.0 * k, 0.05 + 0.2 * k, v=0.0), lost_s=LOST_S * k).findings
    assert found


def test_an_instant_tells_nothing_just_after_lost_time():
    def findings(lost_s):
        judge = detector(CHECKS["acceleration_speed"])
        receive(judge, state(0.0, 0.1, v=0.2), lost_s=0.0)
        receive(judge, state(1.0, 0.3, v=0.2), lost_s=lost_s)
        return receive(judge, state(1.1, 0.32, v=0.1), lost_s=lost_s).findings

    assert findings(0.0)
    assert findings(0.5) == []


def test_a_guard_that_stops_a_car_at_once_is_no_lie():
    judge = detector(CHECKS["speed_consistency"])
    receive(judge, state(0.0, 0.1, v=0.25))
    assert receive(judge, state(0.1, 0.11, v=0.0, a=-0.4)).findings == []
    receive(judge, state(1.0, 0.11, v=0.0))
    assert receive(judge, state(1.1, 0.12, v=0.215, a=0.8)).findings == []


@pytest.mark.parametrize("speeds_mps", [(0.0, 0.8), (0.9, 0.0)])
def test_but_in_half_a_second_nobody_changes_his_speed_by_more_than_his_top_speed(speeds_mps):
    judge, (before, after) = detector(CHECKS["speed_consistency"]), speeds_mps
    receive(judge, state(0.0, 0.1, v=before))
    assert receive(judge, state(0.5, 0.2, v=after)).findings


@pytest.mark.parametrize("name", EYE_DENIES)
def test_an_eye_that_has_not_looked_for_a_while_denies_nothing(name):
    judge = detector(CHECKS[name])
    judge.see(track(state(1.0, 0.3), age_s=0.19))
    assert receive(judge, state(1.0, 0.3, **EYE_DENIES[name])).findings
    judge.see(track(state(2.0, 0.5), age_s=0.21))
    assert receive(judge, state(2.0, 0.5, **EYE_DENIES[name])).findings == []


@pytest.mark.parametrize("name", EYE_DENIES)
def test_an_eye_denies_nothing_until_it_has_seen_for_a_while_that_a_car_stood(name):
    judge = detector(CHECKS[name])
    receive(judge, state(1.0, 0.1))
    for t_s, denies in ((2.0, False), (2.9, False), (3.1, True)):
        judge.see(track(state(t_s, 0.3)))
        found = receive(judge, state(t_s, 0.3, **EYE_DENIES[name]), lost_s=LOST_S).findings
        assert bool(found) is denies


def test_an_old_look_still_speaks_for_a_car_beside_the_road():
    judge = detector(CHECKS["eye_position"], CHECKS["position_plausibility"])
    beside = {"v": 0.0, "shift": (-0.3, -0.6)}
    assert receive(judge, state(0.0, 0.1, **beside)).findings
    judge.see(track(state(1.0, 0.1, **beside), age_s=0.3))
    assert receive(judge, state(1.0, 0.1, **beside)).findings == []


@pytest.mark.parametrize("age_s", [math.nan, math.inf, -math.inf, -1.0, 1e300])
def test_an_age_that_is_no_age_is_an_old_one(age_s):
    told = track(state(1.0, 0.3), age_s=age_s)
    assert seen_ns(told) < told.t_ns - NS_PER_S


def test_a_look_from_the_future_does_not_blind_the_eye_for_good():
    judge = detector(CHECKS["eye_missing"])
    for t_s in (99.0, 1.0):
        judge.see(track(state(t_s, 0.9, name="n2")))
    assert receive(judge, state(1.1, 0.1)).findings


@pytest.mark.parametrize(("age_s", "t_s"), [(0.3, 1.1), (0.0, 1.4)])
def test_an_eye_that_is_late_misses_nobody(age_s, t_s):
    judge = detector(CHECKS["eye_missing"])
    judge.see(track(state(1.0, 0.9, name="n2"), age_s=age_s))
    assert receive(judge, state(t_s, 0.1)).findings == []
