"""Counters against hand-made passages: delay, stops, queue, saturation, level of service."""

import pytest

from scm.maps.grid_city import grid_city
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.traffic.observation.car_estimates import CarEstimate, CarEstimates
from scm.traffic.observation.counters import Counters, level_of, share_below
from scm.traffic.observation.lane_tracking import Follower, rules_of
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_state import VehicleState

CITY = grid_city(2, 3)
ROADS = Roads(CITY)
LANES = ("j0_0_n", "j0_1_nn", "j0_1_n")
LENGTHS = [ROADS.length_of(lane) for lane in LANES]
LINE_M = ROADS.stop_lines_on(LANES[0])[0].at_m
FRONT_M = 0.23
NS = 10**9


def track(vehicle, x):
    rows = tuple(tuple(2.5e-5 * (i == j) for j in range(6)) for i in range(6))
    return EyeTrack(
        vehicle=vehicle, tag_id=1, t_ns=0, x_m=x, y_m=0.0, yaw_rad=0.0, speed_mps=0.1,
        lateral_speed_mps=0.0, yaw_rate_radps=0.0, age_s=0.0, stale=False, covariance=rows,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("delay_s", "signal", "level"),
    [
        (10.0, True, "A"), (10.1, True, "B"), (20.1, True, "C"), (35.1, True, "D"),
        (55.1, True, "E"), (80.0, True, "E"), (80.1, True, "F"),
        (10.0, False, "A"), (15.0, False, "B"), (15.1, False, "C"), (25.1, False, "D"),
        (35.1, False, "E"), (50.1, False, "F"),
    ],
)  # fmt: skip
def test_levels_follow_the_limits_of_the_manual(delay_s, signal, level):
    assert level_of(delay_s, signal=signal) == level


def test_over_saturation_is_level_f_whatever_the_delay():
    assert level_of(5.0, signal=True, saturation=0.99) == "A"
    assert level_of(5.0, signal=True, saturation=1.01) == "F"


def test_the_95_percent_queue_is_not_exceeded_in_95_of_100_samples():
    assert share_below([], 0.95) == 0
    assert share_below([0] * 95 + [7] * 5, 0.95) == 0
    assert share_below([0] * 94 + [7] * 6, 0.95) == 7
    assert share_below(list(range(100)), 0.95) == 94


def drive(counters, follower, vehicle, begin_s, wait_s=0.0, stand_m=0.05, speed=0.25, until_m=99.0):
    """Drive a car along the lanes; it stands `stand_m` before the line for a while."""
    stand_at = LINE_M - FRONT_M - stand_m
    rolls_s = stand_at / speed
    t, end_m = 0.0, min(until_m, sum(LENGTHS[:2]) + 0.3)
    while True:
        is_waiting = rolls_s <= t < rolls_s + wait_s
        way = speed * (t if t < rolls_s else max(rolls_s, t - wait_s))
        if way > end_m:
            return
        at, lane = way, 0
        while at > LENGTHS[lane]:
            at, lane = at - LENGTHS[lane], lane + 1
        x, y, yaw = ROADS.lanes[LANES[lane]].at(at)
        now_ns = round((begin_s + t) * NS)
        shown = 0.0 if is_waiting else speed
        estimate = CarEstimate(vehicle, now_ns, x, y, yaw, shown, 0.01, 0.02, "self")
        counters.see(estimate, follower.see(estimate))
        t += 0.1


def made():
    return Counters(ROADS, rules_of(ROADS)), Follower(ROADS)


def row_of(counters, now_s):
    counts = counters.counts(round(now_s * NS))
    return next(row for row in counts.approaches if row.lane == LANES[0])


@pytest.mark.parametrize(("wait_s", "level"), [(0.0, "A"), (12.0, "B"), (40.0, "D"), (90.0, "F")])
def test_the_delay_is_the_wait_and_grades_the_approach(wait_s, level):
    counters, follower = made()
    counters.sample(0, {})
    drive(counters, follower, "a", 0.0, wait_s)
    row = row_of(counters, 200.0)
    assert row.delay_s == pytest.approx(wait_s, abs=0.3)
    assert row.level == level
    assert row.stops == (1.0 if wait_s else 0.0)
    assert row.passed == 1


def test_who_is_slow_is_delayed_as_well():
    counters, follower = made()
    counters.sample(0, {})
    drive(counters, follower, "a", 0.0, speed=0.125)
    way_m = sum(LENGTHS[:2])
    assert row_of(counters, 100.0).delay_s == pytest.approx(way_m / 0.125 - way_m / 0.25, abs=0.5)


def test_a_car_that_waits_is_in_the_queue_until_it_passes():
    counters, follower = made()
    counters.sample(0, {})
    stand_at = LINE_M - FRONT_M - 0.05
    drive(counters, follower, "a", 0.0, 50.0, until_m=stand_at - 0.01)
    assert row_of(counters, 12.0).queue == 0
    estimate = CarEstimate(
        "a", 20 * NS, *ROADS.lanes[LANES[0]].at(stand_at), 0.0, 0.01, 0.02, "self"
    )
    counters.see(estimate, follower.see(estimate))
    row = row_of(counters, 21.0)
    assert row.queue == 1
    assert row.queue_m == pytest.approx(0.05 + 0.30, abs=0.01)


def test_saturation_is_flow_times_headway_over_the_share_of_green():
    counters, follower = made()
    lane = next(line for line in CITY.stop_lines if line.lane == LANES[0])
    for k in range(100):
        colour = "green" if k % 4 == 0 else "red"
        group = SignalGroup(group=lane.group, colour=colour, since_ns=0, min_end_ns=0)
        spat = Spat(
            junction=lane.junction, t_ns=k * NS, seq=k, mode="plan", plan="calm", groups=(group,)
        )
        counters.sample(k * NS, {lane.junction: spat})
    for n in range(7):
        drive(counters, follower, f"c{n}", 2.5 * n, 20.0)
    row = row_of(counters, 100.0)
    assert row.passed == 7
    assert row.saturation_headway_s == pytest.approx(2.5, abs=0.1)
    assert row.saturation == pytest.approx(0.07 * 2.5 / 0.25, rel=0.05)
    assert row.headway_s == pytest.approx(2.5, abs=0.1)


def test_noise_at_the_line_counts_a_car_once():
    counters, follower = made()
    counters.sample(0, {})
    drive(counters, follower, "a", 0.0, until_m=LINE_M - FRONT_M - 0.05)
    for k in range(100):
        s = LINE_M - FRONT_M + (0.03 if k % 2 else -0.03)
        pose = ROADS.lanes[LANES[0]].at(s)
        estimate = CarEstimate("a", (20 + k) * NS // 2, *pose, 0.0, 0.01, 0.02, "self")
        counters.see(estimate, follower.see(estimate))
    assert row_of(counters, 80.0).passed == 1


def test_the_eye_is_believed_before_the_car_itself():
    estimates = CarEstimates()
    state = VehicleState(
        vehicle="a", t_ns=0, seq=1, x_m=1.0, y_m=0.0, yaw_rad=0.0, speed_mps=0.0,
        yaw_rate_radps=0.0, steering_rad=0.0, throttle=0.0, source="odometry",
    )  # fmt: skip
    estimates.add(state, NS)
    assert [b.source for b in estimates.now(NS)] == ["self"]
    estimates.add(track("a", 2.0), NS)
    estimates.add(track("tag-9", 2.1), NS)
    (one,) = estimates.now(NS)
    assert (one.source, one.x, one.std_m) == ("eye", 2.0, pytest.approx(0.005))
    estimates.add(state, 3 * NS)
    assert [b.source for b in estimates.now(3 * NS)] == ["self"]
    assert estimates.now(5 * NS) == []
