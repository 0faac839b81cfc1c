"""What a junction tells of its lanes, what cars ask of it, and what a car's path looks like."""

import math
from itertools import accumulate

import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import place_of, spatem_of, station_id
from scm.v2x.etsi.path import MAX_POINTS, LowFrequencySender
from scm.v2x.etsi.priority_requests import (
    PriorityAnswer,
    PriorityRequest,
    answers_of,
    requests_of,
    srem_of,
    ssem_of,
)
from scm.v2x.etsi.topology import mapem_of, topology_of
from scm.v2x.messages.spat import Spat
from tests.unit.v2x.test_etsi_convert import NOW, a_state

ROADS = {name: Roads(load_map(name)) for name in ("driving_school", "grid:3x3")}
JUNCTIONS = [
    pytest.param(roads, junction, id=f"{name}-{junction.name}")
    for name, roads in ROADS.items()
    for junction in roads.city_map.junctions
]
every_junction = pytest.mark.parametrize(("roads", "junction"), JUNCTIONS)


@every_junction
def test_map_and_phases_name_the_same_junction_revision_and_groups(roads, junction):
    groups = tuple(
        SignalGroup(group=group.name, colour="red", since_ns=NOW, min_end_ns=NOW)
        for group in junction.groups
    )
    revision = roads.city_map.revision
    spat = Spat(
        junction=junction.name,
        t_ns=NOW,
        seq=0,
        mode="plan",
        plan="p",
        groups=groups,
        revision=revision,
    )
    spatem, mapem = spatem_of(spat, junction), mapem_of(roads, junction)
    (geometry,) = mapem.intersections
    assert (geometry.id.id, geometry.revision) == (spatem.intersection, spatem.revision)
    assert mapem.station_id == spatem.station_id
    released = {way.signal_group for lane in geometry.lane_set for way in lane.connects_to or ()}
    assert released == {state.signal_group for state in spatem.states}


@every_junction
def test_a_lane_in_begins_at_its_stop_line_and_each_way_ends_on_the_lane_it_names(roads, junction):
    (geometry,) = mapem_of(roads, junction).intersections
    topology = topology_of(roads, junction)
    origin = place_of(geometry.ref_point.latitude, geometry.ref_point.longitude)
    for lane, stretch in zip(
        geometry.lane_set, (*topology.lanes_in, *topology.lanes_out), strict=True
    ):
        nodes = [node.delta.node_xy for node in lane.node_list.nodes]
        x = [origin[0] + far / 1400.0 for far in accumulate(node.x for node in nodes)]
        y = [origin[1] + far / 1400.0 for far in accumulate(node.y for node in nodes)]
        line = roads.lane(stretch.lane)
        for at, place in ((stretch.near_m, (x[0], y[0])), (stretch.far_m, (x[-1], y[-1]))):
            pose = line.at(at)
            assert math.dist(place, (pose.x, pose.y)) < 2e-3
    numbers = [lane.lane_id for lane in geometry.lane_set]
    assert numbers == list(range(1, len(numbers) + 1))
    assert all(way.lane_out > len(topology.lanes_in) for way in topology.ways)
    movements = sum(len(group.movements) for group in junction.groups)
    assert len(topology.ways) == movements


def test_a_connection_has_its_turning_direction():
    roads = ROADS["grid:3x3"]
    junction = max(roads.city_map.junctions, key=lambda one: len(one.groups))
    (geometry,) = mapem_of(roads, junction).intersections
    turns = {
        way.connecting_lane.maneuver[:4]
        for lane in geometry.lane_set
        for way in lane.connects_to or ()
    }
    assert turns == {"1000", "0100", "0010"}


def test_groups_and_lanes_find_each_other():
    roads = ROADS["driving_school"]
    topology = topology_of(roads, roads.city_map.junctions[0])
    assert topology.lane_in("south_west") == 2
    assert topology.group_of(2) == "south_west"
    assert topology.lane_out("crossing_south_west") == 4
    assert (topology.lane_in("north"), topology.group_of(3), topology.lane_out("x")) == (None,) * 3


def a_wish(**changes):
    wish = PriorityRequest(
        station_id=station_id("n1"), number=5, junction=7, lane_in=2, role="emergency",
        arrives_ns=NOW + 3 * NS_PER_S, lasts_s=2.5, sequence=9,
    )  # fmt: skip
    return wish._replace(**changes)


@pytest.mark.parametrize("verb", ["request", "update", "cancel"])
def test_a_priority_request_is_read_back_by_the_junction(verb):
    wish = a_wish(verb=verb, lane_out=3)
    assert requests_of(srem_of(wish, a_state()), NOW + NS_PER_S) == (wish,)


@pytest.mark.parametrize("t_s", [0, -3600, 364 * 86_400])
def test_an_arrival_is_understood_across_the_turn_of_the_year(t_s):
    arrives = (1_798_761_600 + t_s) * NS_PER_S + 250 * NS_PER_MS
    body = srem_of(a_wish(arrives_ns=arrives), a_state(t_ns=arrives - 5 * NS_PER_S))
    (wish,) = requests_of(body, arrives - 5 * NS_PER_S)
    assert wish.arrives_ns == arrives


def test_a_car_receives_only_its_own_answer():
    junction = ROADS["driving_school"].city_map.junctions[0]
    answers = [
        PriorityAnswer(a_wish(), "granted"),
        PriorityAnswer(a_wish(station_id=1, number=6), "rejected"),
    ]
    body = ssem_of(junction, answers, 1, NOW)
    assert answers_of(body, station_id("n1")) == {(junction.number, 5): "granted"}
    assert answers_of(body, 1) == {(junction.number, 6): "rejected"}


def test_the_low_frequency_container_is_sent_every_half_second_with_the_path():
    news, told = LowFrequencySender(role="emergency"), []
    for step in range(200):
        t_ns, x_m = NOW + step * 100 * NS_PER_MS, 0.026 * step
        state = a_state(t_ns=t_ns, x_m=x_m, y_m=0.5 * x_m, lights=("left",))
        container = news.due(state, 0.2)
        if container is not None:
            told.append((state, container.basic_vehicle_container_low_frequency))
    assert len(told) == 40
    state, last = told[-1]
    assert last.vehicle_role == 6
    assert last.exterior_lights.left_turn_signal_on
    assert not last.exterior_lights.low_beam_headlights_on
    assert len(last.path_history) <= MAX_POINTS
    west = sum(point.path_position.delta_longitude for point in last.path_history)
    south = sum(point.path_position.delta_latitude for point in last.path_history)
    x_m, y_m = place_of(-south, -west)
    assert y_m == pytest.approx(0.5 * x_m, abs=0.01)
    spent_s = sum(point.path_delta_time for point in last.path_history) / 100.0
    assert x_m == pytest.approx(0.26 * spent_s, abs=0.01)
    assert x_m == pytest.approx(state.x_m, abs=0.35), "the whole way so far"
