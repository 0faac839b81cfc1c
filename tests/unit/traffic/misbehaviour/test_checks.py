"""Each check alone: it doubts the lie it is made for, and nothing in a car that drives honestly."""

import math

import msgspec
import pytest

from scm.clock import NS_PER_S
from scm.traffic.misbehaviour.check import load_checks
from tests.unit.traffic.misbehaviour.claims import (
    RSU,
    START_NS,
    body,
    detector,
    receive,
    state,
    track,
)

CHECKS = {check.name: check for check in load_checks()}
PERIOD_S = 0.5
NEAR = [(k * PERIOD_S, 0.1 + 0.2 * k * PERIOD_S) for k in range(6)]


def drive(**changes):
    """Return the states of a car along its lane; from the third on some are other ones."""
    told = []
    for k, (t_s, s_m) in enumerate(NEAR):
        options = {name: f(k, t_s) for name, f in changes.items()} if k >= 2 else {}
        told.append(state(t_s, **({"s_m": s_m} | options)))
    return told


def least(name, told, **options):
    """Return the least plausibility that one check finds in all claims."""
    judge = detector(CHECKS[name])
    found = [1.0]
    for one in told:
        judged = receive(judge, one, **options)
        found += [plausibility for _, plausibility in judged.findings]
    return min(found)


LIES = {
    "range_plausibility": {"shift": lambda _k, _t: (25.0, 0.0)},
    "position_plausibility": {"shift": lambda _k, _t: (-0.3, -0.6)},
    "position_consistency": {"shift": lambda k, _t: (0.8 * (k % 2), 0.0)},
    "speed_plausibility": {"v": lambda _k, _t: 0.5},
    "position_speed_consistency": {"v": lambda _k, _t: 0.0},
    "position_speed_max_consistency": {"v": lambda _k, _t: 0.0, "s_m": lambda k, _t: 0.35 * k},
    "speed_consistency": {"v": lambda k, _t: 0.9 * (k % 2)},
    "acceleration_plausibility": {"a": lambda _k, _t: 2.0},
    "position_heading_consistency": {"turn": lambda _k, _t: math.pi},
    "heading_consistency": {"turn": lambda k, _t: math.pi * (k % 2)},
    "lane_heading": {"turn": lambda _k, _t: math.pi},
    "kalman_position": {"shift": lambda k, _t: (0.3 * (k % 2), 0.0)},
    "kalman_speed": {"v": lambda k, _t: 1.2 * (k % 2)},
    "kalman_position_speed": {"v": lambda k, _t: 1.2 * (k % 2)},
}


@pytest.mark.parametrize("name", LIES)
def test_a_check_doubts_the_lie_it_is_made_for(name):
    assert least(name, drive(**LIES[name])) < 0.05


@pytest.mark.parametrize("name", CHECKS)
def test_no_check_doubts_a_car_that_drives_along_its_lane(name):
    judge = detector(CHECKS[name])
    for told in drive():
        judge.see(track(told))
        assert receive(judge, told).findings == []


def test_acceleration_must_be_that_of_the_speeds():
    told = [state(0.1 * k, 0.1 + 0.02 * k, v=0.2, a=0.6) for k in range(5)]
    assert least("acceleration_speed", told) < 0.05
    told = [state(0.1 * k, 0.1 + 0.01 * k, v=0.05 + 0.05 * k, a=0.5) for k in range(5)]
    assert least("acceleration_speed", told) == 1.0


def test_a_small_constant_lie_about_speed_is_found_by_the_seconds():
    told = [state(0.3 * k, 0.05 + 0.06 * k, v=0.25) for k in range(20)]
    assert least("position_speed_consistency", told[:4]) == 1.0
    assert least("position_speed_consistency", told) < 0.01


def test_who_brakes_while_nobody_hears_it_has_not_lied_about_the_way():
    cruise = [state(0.25 * k, 0.05 + 0.0625 * k, v=0.25) for k in range(9)]
    braked = [state(4.5, 0.05 + 1.05, v=0.05), state(4.7, 0.05 + 1.056, v=0.01)]
    assert least("position_speed_consistency", cruise + braked) == 1.0


@pytest.mark.parametrize("name", ["acceleration_plausibility", "acceleration_speed"])
@pytest.mark.parametrize("witness", ["its claim", "the Eye", "a stale track"])
def test_who_is_pushed_has_not_lied_about_his_acceleration(name, witness):
    judge, findings = detector(CHECKS[name]), []
    for k in range(8):
        beside = state(0.2 * k, 0.1 + 0.29, v=0.0, name="n2")
        if k >= 4:  # until then it stands alone, and presses against nothing
            if witness == "its claim":
                receive(judge, beside)
            else:
                judge.see(track(beside, stale=witness == "a stale track"))
        findings.append(receive(judge, state(0.2 * k, 0.1, v=0.0, a=1.14)).findings)
    assert any(findings[:4])
    assert not any(findings[4:])


def test_cams_come_at_most_every_tenth_of_a_second():
    assert least("beacon_frequency", [state(0.04 * k, 0.1) for k in range(4)]) < 1e-3
    assert least("beacon_frequency", [state(0.1 * k, 0.1 + 0.02 * k) for k in range(4)]) == 1.0


def test_cams_of_a_car_that_stands_come_once_a_second():
    assert least("beacon_frequency", [state(0.2 * k, 0.1, v=0.0) for k in range(12)]) < 1e-2
    assert least("beacon_frequency", [state(1.0 * k, 0.1, v=0.0) for k in range(12)]) == 1.0


def test_a_cam_told_again_is_not_a_new_one():
    judge, told = detector(CHECKS["beacon_frequency"]), state(0.0, 0.1)
    receive(judge, told)
    again = receive(judge, told, sent_ns=told.t_ns + NS_PER_S // 2)
    assert [plausibility for _, plausibility in again.findings] == [pytest.approx(1e-9)]


def test_two_cars_cannot_stand_in_each_other_and_the_newcomer_is_to_blame():
    judge = detector(CHECKS["intersection"])
    receive(judge, state(0.0, 0.3, v=0.0))
    receive(judge, state(2.0, 0.3, v=0.0))
    ghost = receive(judge, state(2.1, 0.35, v=0.0, name="n2"))
    honest = receive(judge, state(2.9, 0.3, v=0.0))
    assert ghost.findings
    assert not honest.findings


def test_two_cars_behind_each_other_do_not_overlap():
    judge = detector(CHECKS["intersection"])
    receive(judge, state(0.0, 0.3, v=0.0))
    assert receive(judge, state(0.1, 0.66, v=0.0, name="n2")).findings == []


def test_a_car_that_appears_amid_the_roads_is_odd_unless_cars_come_in_there():
    check = CHECKS["sudden_appearance"]
    judge = detector(check)
    for k in range(6):
        receive(judge, state(1.0 * k, 0.3, v=0.0))
    x, y = judge._ground.spawns[0]
    pose = state(5.0, 0.0, name="n2")
    there = msgspec.structs.replace(pose, x_m=x, y_m=y)
    assert receive(judge, there).findings == []
    far = msgspec.structs.replace(pose, vehicle="n3", x_m=40.0, y_m=40.0)
    assert receive(judge, far).findings


def test_who_heard_nobody_for_seconds_cannot_say_who_has_suddenly_appeared():
    judge = detector(CHECKS["sudden_appearance"])
    for k in range(6):
        receive(judge, state(1.0 * k, 0.3, v=0.0))
    far = msgspec.structs.replace(state(8.0, 0.0, name="n3"), x_m=40.0, y_m=40.0)
    assert receive(judge, far).findings == []


def test_who_uses_another_number_than_its_own_is_found_by_its_key():
    judge = detector(CHECKS["identity"])
    assert receive(judge, state(0.0, 0.3), station="n9").findings
    assert receive(judge, state(1.0, 0.3, name="n2")).findings == []


def test_a_car_does_not_grow():
    judge = detector(CHECKS["static"])
    receive(judge, state(0.0, 0.3))
    assert receive(judge, state(0.5, 0.4), length_m=0.3).findings == []
    assert receive(judge, state(1.0, 0.5), length_m=0.5).findings


@pytest.mark.parametrize(
    ("name", "lie"),
    [
        ("eye_position", {"shift": (0.2, 0.0)}),
        ("eye_speed", {"v": 0.05}),
        ("eye_heading", {"turn": 0.5}),
    ],
)
def test_the_eye_contradicts_what_it_sees_otherwise(name, lie):
    judge = detector(CHECKS[name])
    judge.see(track(state(1.0, 0.3)))
    assert receive(judge, state(1.0, 0.3)).findings == []
    judge.see(track(state(2.0, 0.5)))
    assert receive(judge, state(2.0, 0.5, **lie)).findings


def test_an_unsure_eye_contradicts_nobody():
    judge = detector(CHECKS["eye_position"])
    judge.see(track(state(1.0, 0.3), std=0.5))
    assert receive(judge, state(1.0, 0.3, shift=(0.2, 0.0))).findings == []


def test_a_stale_track_is_no_witness():
    judge = detector(CHECKS["eye_position"])
    judge.see(track(state(1.0, 0.3), stale=True))
    assert receive(judge, state(1.0, 0.3, shift=(0.2, 0.0))).findings == []


def test_a_ghost_is_where_the_eye_sees_nobody():
    judge = detector(CHECKS["eye_missing"])
    judge.see(track(state(1.0, 0.9, name="n2")))
    assert receive(judge, state(1.0, 0.1)).findings
    assert receive(judge, state(1.0, 0.9, name="n3")).findings == []  # there somebody is


def test_without_an_eye_that_works_nobody_is_missed():
    judge = detector(CHECKS["eye_missing"])
    judge.see(track(state(1.0, 0.9, name="n2")))
    assert receive(judge, state(3.0, 0.1)).findings == []


def test_a_lie_about_how_sure_one_is_does_not_help():
    told = [body(one) for one in drive(shift=lambda k, _t: (0.8 * (k % 2), 0.0))]
    judge, found = detector(CHECKS["position_consistency"]), []
    for one, (t_s, _) in zip(told, NEAR, strict=True):
        place = one.position
        ellipse = msgspec.structs.replace(place.position_confidence_ellipse, semi_major=4094)
        place = msgspec.structs.replace(place, position_confidence_ellipse=ellipse)
        basic = msgspec.structs.replace(one.basic_container, reference_position=place)
        unsure = msgspec.structs.replace(one, basic_container=basic)
        found += judge.receive("n1", RSU, START_NS + round(t_s * NS_PER_S), unsure).findings
    assert found
