"""Errands of a car: route requests in, progress out."""

import pytest

from scm.clock import NS_PER_MS
from scm.errors import LeaseError, MapError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.v2x.messages.route_request import RouteRequest
from scm.vehicles.driver import CarLimits, RouteView
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.single_car import OWN, TripDriver
from scm.vehicles.drivers.trips import Trips

LIMITS = CarLimits(0.14154, 0.5236, 0.42, 0.23, 0.07, 0.175, speeds=(0.13, 0.27))


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture(scope="module")
def roads(city_map):
    return Roads(city_map)


@pytest.fixture
def start(roads):
    return roads.lane("east_loop").at(0.5)


@pytest.fixture
def trips(roads, start):
    return TripDriver("n7", roads, LIMITS, start, 0)


@pytest.fixture
def view(city_map):
    signals = SignalTable(city_map)

    def make(pose, now_ms=20):
        return RouteView(now_ms * NS_PER_MS, pose, 0.0, signals)

    return make


def test_a_car_circulates_without_end_at_first(trips, view, start):
    trips.decide(view(start))
    (trip,) = trips.reports(20 * NS_PER_MS)
    assert trip.route[0] == "east_loop"
    assert trip.length_m is None
    assert trip.arrived_ns is None


def test_reports_come_twice_a_second(trips, view, start):
    trips.decide(view(start))
    times = [t for t in range(0, 2000, 20) if trips.reports(t * NS_PER_MS)]
    assert times == [0, 500, 1000, 1500]


def test_a_request_is_answered_with_the_lanes_between_filled_in(trips, start):
    request = RouteRequest(vehicle="n7", via=("west_loop",), request_id="r1")
    reply = trips.begin(request, start, 0)
    assert reply.route == ("east_loop", "crossing_south_west", "west_loop")
    assert reply.trip_id == "r1"


def test_the_length_of_a_trip_counts_from_where_the_car_is(trips, roads, start):
    reply = trips.begin(RouteRequest(vehicle="n7", via=("east_loop",)), start, 0)
    assert reply.length_m == pytest.approx(roads.lane("east_loop").length_m - 0.5, abs=0.01)


def test_a_trip_without_lanes_has_no_end(trips, start):
    assert trips.begin(RouteRequest(vehicle="n7"), start, 0).length_m is None


def test_two_trips_have_two_ids(trips, start):
    ids = {trips.begin(RouteRequest(vehicle="n7"), start, 0).trip_id for _ in range(3)}
    assert len(ids) == 3


def test_an_impossible_trip_is_refused_and_changes_nothing(trips, start):
    before = trips.begin(RouteRequest(vehicle="n7", via=("west_loop",)), start, 0)
    with pytest.raises(MapError, match="nowhere"):
        trips.begin(RouteRequest(vehicle="n7", via=("nowhere",)), start, 0)
    (told,) = trips.reports(0)
    assert (told.trip_id, told.route) == (before.trip_id, before.route)


def test_a_car_beside_all_lanes_stands_and_says_why(roads, view):
    driver = TripDriver("n7", roads, LIMITS, Pose2(50.0, 50.0, 0.0), 0)
    assert "n7: no lane" in driver.off_lane
    assert driver.decide(view) == (0.0, 0.0)


def test_a_trip_reports_its_remaining_stops_so_that_it_can_continue(trips, roads, view, start):
    request = RouteRequest(
        vehicle="n7", via=("west_loop", "east_loop"), laps=2, speed_mps=0.1, then="circulate"
    )
    route = trips.begin(request, start, 0).route
    (trip,) = trips.reports(0)
    assert trip.via == ("west_loop", "east_loop", "west_loop", "east_loop")
    assert (trip.speed_mps, trip.then) == (0.1, "circulate")
    passed_m, left = -0.5, []
    for t_s, lane in enumerate(route, 1):
        passed_m += roads.lane(lane).length_m
        trips.driver.batch.done_m[OWN] = passed_m + 0.01
        (trip,) = trips.reports(t_s * 1000 * NS_PER_MS)
        left.append(trip.via)
    after_west = [via for lane, via in zip(route, left, strict=True) if lane == "west_loop"]
    assert list(map(len, after_west)) == [3, 1]
    assert left[-1] == ()
    trips.driver.batch.done_m[OWN] = 0.0
    trips.begin(RouteRequest(vehicle="n7", speed_mps=0.2), start, 0)
    assert [(t.via, t.speed_mps) for t in trips.reports(0)] == [((), 0.2)]


def test_a_lane_whose_end_is_reached_is_passed(trips, start):
    reply = trips.begin(RouteRequest(vehicle="n7", via=("west_loop",)), start, 0)
    trips.driver.batch.done_m[OWN] = reply.length_m
    assert [trip.via for trip in trips.reports(0)] == [()]


def test_a_request_that_may_replace_one_trip_replaces_no_other(trips, start):
    request = RouteRequest(vehicle="n7", via=("west_loop",), request_id="t", replaces="n7-1")
    assert trips.begin(request, start, 0).trip_id == "t"
    with pytest.raises(LeaseError, match="it is on trip 't', expected 'n7-1'"):
        trips.begin(request, start, 0)
    trips._trips.end(OWN, 0)
    with pytest.raises(LeaseError, match="somebody drove it since its trip 't'"):
        trips.begin(RouteRequest(vehicle="n7", replaces="t"), start, 0)
    assert trips.begin(RouteRequest(vehicle="n7"), start, 0)
    trips._trips.forget(OWN)
    with pytest.raises(LeaseError, match="it is on no trip"):
        trips.begin(RouteRequest(vehicle="n7", replaces="t"), start, 0)


def test_spread_reports_keep_to_their_own_turn(trips, start):
    trips = Trips(trips.driver.batch, spread=True)
    trips.circulate(OWN, "n7", start, 0)
    times = [t for t in range(130, 2000, 10) if trips.reports(t * NS_PER_MS)]
    assert times == [130, 500, 1000, 1500]


def test_another_car_in_its_row_restarts_the_trip_numbers(trips, start):
    trips = Trips(trips.driver.batch)
    for vehicle in ("n7", "n7", "n8"):
        trips.circulate(OWN, vehicle, start, 0)
    assert [trip.trip_id for trip in trips.reports(0)] == ["n8-1"]


def test_the_final_report_of_a_trip_is_sent_once(trips, start):
    trips = Trips(trips.driver.batch)
    trips.circulate(OWN, "n7", start, 0)
    trips.end(OWN, 0)
    trips.end(OWN, 0)
    assert len(trips.reports(0)) == 1


@pytest.mark.parametrize("then", ["stop", "circulate"])
def test_an_arrival_is_reported_once_and_immediately(trips, view, roads, start, then):
    request = RouteRequest(
        vehicle="n7", via=("east_loop",), request_id="r1", then=then, speed_mps=0.1
    )
    trips.begin(request, start, 0)
    trips.decide(view(start))
    trips.reports(0)
    lane = roads.lane("east_loop")
    for s in (1.5, 2.0, lane.length_m - 0.005, lane.length_m - 0.001):
        trips.decide(view(lane.at(s), 40))
    told = trips.reports(40 * NS_PER_MS)
    ends = [trip for trip in told if trip.arrived_ns is not None]
    assert [trip.trip_id for trip in ends] == ["r1"]
    assert {trip.speed_mps for trip in told} == {0.1}
    assert ends[0].done_m == pytest.approx(lane.length_m - 0.5, abs=0.02)
    assert [trip.trip_id for trip in told if trip.arrived_ns is None] == (
        ["n7-3"] if then == "circulate" else []
    )
