"""Places along straights and arcs, against the sampled paths of the map."""

import math

import numpy as np
import pytest

from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.vehicles.driver import CarLimits
from scm.vehicles.drivers.driver_batch import DriverBatch
from scm.vehicles.drivers.lane_graph import CURVATURE, LENGTH, YAW, LaneGraph
from scm.vehicles.drivers.lane_tracking import heading_change, list_segments, segment_at

NIGEL = CarLimits(0.14154, 0.5236, 0.42, 0.23, 0.07, 0.175, speeds=(0.13, 0.27))
LAP = ("east_loop", "crossing_south_west", "west_loop", "crossing_south_east")


@pytest.fixture(scope="module")
def roads():
    return Roads(load_map("driving_school"))


@pytest.fixture(scope="module")
def lap(roads):
    return Path(roads, LAP, closed=True)


@pytest.mark.parametrize("beside", [0.0, 0.08, -0.2])
def test_a_car_that_is_led_along_its_way_is_found_where_it_is(roads, lap, beside):
    drivers = DriverBatch(LaneGraph(roads), 1)
    drivers.enter(0, NIGEL)
    drivers.send(0, LAP, 0.4, "loop")
    driven = np.ones(1, np.bool_)
    for tick, s in enumerate(np.arange(0.4, 0.4 + 1.5 * lap.length_m, 0.05)):
        x, y, yaw = lap.at(s)
        x, y = x - beside * math.sin(yaw), y + beside * math.cos(yaw)
        drivers.decide(tick * 10**7, *np.array([[x], [y], [yaw], [0.2]]), driven)
        assert drivers.done_m[0] == pytest.approx(s - 0.4, abs=1e-4)
        assert drivers.cross_track[0] == pytest.approx(beside, abs=1e-4)
        assert drivers.lane_graph.names[drivers.lane[0]] == lap.lane_at(s)


def test_a_car_pushed_back_over_the_start_of_its_lane_is_found_again(roads, lap):
    drivers = DriverBatch(LaneGraph(roads), 1)
    drivers.enter(0, NIGEL)
    drivers.send(0, LAP, 2.0, "stop")
    start = roads.lane("east_loop").length_m
    for tick, s in enumerate((2.0, start + 0.1, start - 0.1, start + 0.2)):
        x, y, yaw = lap.at(s)
        drivers.decide(tick * 10**7, *np.array([[x], [y], [yaw], [0.2]]), np.ones(1, np.bool_))
        assert drivers.lane_graph.names[drivers.lane[0]] == lap.lane_at(s)
        assert drivers.done_m[0] == pytest.approx(s - 2.0, abs=1e-4)


@pytest.mark.parametrize("offset", [-0.3, -0.05, 0.0, 0.07, 0.4, 1.3])
def test_the_turn_along_the_way_is_that_of_the_map(roads, lap, offset):
    ways = LaneGraph(roads).arrays
    numbers = [LaneGraph(roads).numbers[name] for name in LAP]
    lane_window = np.array([numbers[3], *numbers, -1, -1, -1], np.int64)
    ids, begins = np.zeros(32, np.int64), np.zeros(33)
    for s in (0.0, 0.5, 2.0):
        count, here, _ = list_segments(
            ways.segment_first, ways.segments, lane_window, s, 0.4, 2.0, ids, begins
        )
        seen = heading_change(ways.segments, ids, begins, count, here, offset)
        pieces = np.linspace(s, s + offset, 400)
        expected = np.sum([lap.curvature(p) for p in pieces[:-1]]) * offset / 399
        assert seen == pytest.approx(expected, abs=0.02)


def test_a_route_that_ends_ahead_is_marked(roads):
    lane_graph = LaneGraph(roads)
    ways, lane = lane_graph.arrays, lane_graph.numbers["east_loop"]
    ids, begins = np.zeros(32, np.int64), np.zeros(33)
    lane_window = np.array([-1, lane, -1, -1, -1, -1, -1, -1], np.int64)
    far = list_segments(ways.segment_first, ways.segments, lane_window, 1.0, 0.1, 2.0, ids, begins)
    assert far[2]
    assert begins[far[0]] == pytest.approx(roads.length_of("east_loop") - 1.0)
    assert not list_segments(
        ways.segment_first, ways.segments, lane_window, 1.0, 0.1, 0.5, ids, begins
    )[2]


def test_segments_lie_on_the_lanes_of_the_map(roads):
    lane_graph = LaneGraph(roads)
    for number, name in enumerate(lane_graph.names):
        lane = roads.lane(name)
        for s in np.linspace(0.01, lane.length_m - 0.01, 7):
            row = lane_graph.arrays.segments[
                segment_at(lane_graph.arrays.segment_first, lane_graph.arrays.segments, number, s)
            ]
            here = row[YAW] + row[CURVATURE] * (s - row[0])
            assert math.cos(here - lane.at(s).yaw) == pytest.approx(1.0, abs=1e-6)
        assert lane_graph.arrays.length[number] == pytest.approx(lane.length_m)


def test_a_segment_lies_in_its_rectangle():
    roads = Roads(grid_city(2, 2))
    lane_graph = LaneGraph(roads)
    for number, name in enumerate(lane_graph.names):
        first = lane_graph.arrays.segment_first[number]
        west, south, east, north = lane_graph.arrays.segments[first, 9:13]
        points = roads.lane(name).points
        assert west - 1e-3 <= points[:, 0].min()
        assert points[:, 0].max() <= east + 1e-3
        assert south - 1e-3 <= points[:, 1].min()
        assert points[:, 1].max() <= north + 1e-3
        assert lane_graph.arrays.segments[first, LENGTH] > 0.0


def test_a_lane_that_leads_nowhere_is_known_for_it(roads):
    school = roads.city_map
    cut = [
        type(lane)(**{key: getattr(lane, key) for key in lane.__struct_fields__} | {"next": ()})
        if lane.name == "east_loop"
        else lane
        for lane in school.lanes
    ]
    fields = {key: getattr(school, key) for key in school.__struct_fields__}
    lane_graph = LaneGraph(Roads(type(school)(**fields | {"lanes": tuple(cut)})))
    assert lane_graph.goes_round == [False] * 4
    assert lane_graph.round_from("west_loop") is None
    assert LaneGraph(roads).round_from("east_loop") == LAP
