"""Detectors tell who stands and drives before a line, from nothing but where cars are believed."""

import math

import pytest

from scm.clock import NS_PER_S
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.signals.detectors import MAX_AGE_NS, MAX_SILENCE_NS, JunctionDetectors, Seen

MAP = load_map("driving_school")
ROADS = Roads(MAP)
JUNCTION = MAP.junctions[0]
LANE, LINE_M = "crossing_south_east", 0.3987
FEEDER = "west_loop"


@pytest.fixture
def watcher():
    return JunctionDetectors(JUNCTION, ROADS)


def at(before_m, speed=0.0, who=1, t_s=0.0):
    """Return a car whose front is so far before the line of `south_east`; negative: beyond."""
    s = LINE_M - before_m
    lane = ROADS.lane(LANE) if s >= 0.0 else ROADS.lane(FEEDER)
    pose = lane.at(s if s >= 0.0 else lane.length_m + s)
    return Seen(who, round(t_s * NS_PER_S), pose.x, pose.y, pose.yaw, speed, 0.30)


def read(watcher, t_s=0.0, group="south_east"):
    return watcher.by_group(watcher.read(round(t_s * NS_PER_S)))[group]


def show(watcher, *cars):
    for car in cars:
        watcher.add(car, car.t_ns)


def test_nobody_is_there_at_first_and_nothing_is_seen(watcher):
    detector = read(watcher)
    assert not detector.call
    assert detector.gap_s is None
    assert not watcher.sees(0)


def test_a_car_that_waits_calls_its_own_group_alone(watcher):
    show(watcher, at(0.05))
    detector = read(watcher)
    assert detector.call
    assert detector.presence
    assert (detector.queue, detector.near) == (1, 1)
    assert detector.queue_m == pytest.approx(0.35, abs=0.02)
    assert not read(watcher, group="south_west").call


def test_a_car_on_the_lane_before_counts_and_one_out_of_reach_does_not(watcher):
    show(watcher, at(1.2, speed=0.2))
    assert read(watcher).call
    assert not read(watcher).presence
    show(watcher, at(2.45, who=2))
    assert read(watcher).near == 1


def test_cars_that_drive_tell_when_they_arrive_and_those_that_stand_do_not(watcher):
    show(watcher, at(1.0, speed=0.25, who=1), at(0.5, speed=0.2, who=2), at(0.05, who=3))
    assert read(watcher).arrivals_s == pytest.approx((2.5, 4.0), abs=0.1)


def test_a_car_beside_the_lane_or_against_it_is_nobody(watcher):
    car = at(0.3)
    show(watcher, car._replace(x_m=car.x_m - 0.4 * math.sin(car.yaw_rad), y_m=car.y_m + 0.4))
    show(watcher, car._replace(who=2, yaw_rad=car.yaw_rad + math.pi))
    assert not read(watcher).call


def test_a_queue_ends_where_a_car_still_drives_or_a_gap_is(watcher):
    show(watcher, at(0.05), at(0.5, who=2), at(0.95, who=3, speed=0.2))
    detector = read(watcher)
    assert (detector.queue, detector.near) == (2, 3)
    assert detector.queue_m == pytest.approx(0.8, abs=0.02)


def test_a_moving_car_is_brought_forward_and_keeps_a_green_when_it_is_near(watcher):
    show(watcher, at(0.9, speed=0.25))
    assert not read(watcher, 0.0).extend
    assert read(watcher, 1.0).extend
    assert read(watcher, 1.0).gap_s == 0.0


def test_the_gap_grows_once_the_last_car_has_gone(watcher):
    show(watcher, at(0.1, speed=0.25))
    read(watcher, 0.0)
    show(watcher, at(-0.3, speed=0.25, t_s=1.0))
    assert read(watcher, 1.0).gap_s == pytest.approx(1.0)


def test_a_car_that_passes_the_line_is_counted_once(watcher):
    for n, before_m in enumerate((0.3, 0.1, -0.1, -0.3)):
        show(watcher, at(before_m, speed=0.2, t_s=float(n)))
        read(watcher, float(n))
    assert read(watcher, 3.0).count == 1
    assert not read(watcher, 3.0).call


def test_a_car_that_falls_silent_is_forgotten_and_old_news_is_ignored(watcher):
    show(watcher, at(0.05, t_s=1.0))
    show(watcher, at(-0.5, t_s=0.5))
    assert read(watcher, 1.0).call
    assert not read(watcher, 1.1 + MAX_AGE_NS / NS_PER_S).call


def test_it_is_blind_when_nothing_was_heard_for_long(watcher):
    show(watcher, at(0.05))
    assert watcher.sees(MAX_SILENCE_NS)
    assert not watcher.sees(MAX_SILENCE_NS + 1)


def test_a_car_that_stands_behind_the_junction_is_ahead(watcher):
    out = ROADS.lane("east_loop").at(0.3)
    show(watcher, Seen(7, 0, out.x, out.y, out.yaw, 0.0, 0.3))
    assert read(watcher).ahead == 1
    show(watcher, Seen(7, 1, out.x, out.y, out.yaw, 0.2, 0.3))
    assert read(watcher).ahead == 0
