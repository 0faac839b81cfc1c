"""Cities made to measure."""

import itertools
import math

import msgspec
import numpy as np
import pytest

from scm.errors import MapError
from scm.maps.check import problems_of
from scm.maps.conflicts import conflicting_groups
from scm.maps.draw import draw_svg
from scm.maps.grid_city import grid_city
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.traffic.monitor.conflict_table import conflict_table_of
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.program import program_of

NIGEL_RADIUS_M = 0.245


@pytest.fixture(scope="module")
def city():
    return grid_city(3, 4, block_m=3.0)


@pytest.fixture(scope="module")
def roads(city):
    return Roads(city)


@pytest.mark.parametrize("size", [(2, 2), (2, 5), (3, 4), (6, 3)])
def test_nothing_is_wrong_with_it(size):
    assert problems_of(grid_city(*size)) == []


def test_it_is_loaded_by_name():
    assert load_map("grid:3x4:3") == grid_city(3, 4, block_m=3.0)
    assert load_map("grid:3x2") == grid_city(3, 2)


@pytest.mark.parametrize(
    "name", ["grid:1x4", "grid:3", "grid:3x4x5", "grid:99x99", "grid:3x3:1", "grid:axb"]
)
def test_a_city_that_cannot_be_is_refused_in_words(name):
    with pytest.raises(MapError, match="grid"):
        load_map(name)


def test_it_travels_as_json_unchanged(city):
    assert msgspec.json.decode(msgspec.json.encode(city), type=CityMap) == city


def test_every_lane_can_be_reached_from_every_other(city, roads):
    names = [lane.name for lane in city.lanes]
    for goal in names[1::7]:
        assert roads.route(names[0], (goal,))[-1] == goal
        assert roads.route(goal, (names[0],))[-1] == names[0]


def test_every_bend_can_be_driven_with_room_to_spare(city):
    radii = {s.radius_m for lane in city.lanes for s in lane.segments if s.radius_m}
    assert min(radii) > 1.5 * NIGEL_RADIUS_M


def test_every_junction_of_more_than_two_streets_has_signals(city):
    assert len(city.junctions) == 3 * 4 - 4
    for junction in city.junctions:
        arms = {lane.name for lane in city.lanes if lane.name.rpartition("_")[0] == junction.name}
        streets = [name for name in arms if len(name.rpartition("_")[2]) == 1]
        assert len(junction.groups) == len(streets)


def test_controller_and_monitor_agree_on_what_conflicts(city, roads):
    for junction in city.junctions:
        program, card = program_of(junction, roads), conflict_table_of(city, junction)
        pairs = {tuple(sorted(pair)) for pair in program.conflicts}
        assert pairs == set(card.conflicts)
        assert pairs


def test_what_looks_alike_is_judged_as_if_it_stood_alone(city):
    together = Roads(city)
    for junction in city.junctions:
        assert conflicting_groups(junction, together) == conflicting_groups(junction, Roads(city))


def test_ways_that_cross_belong_to_groups_in_conflict(city, roads):
    junction = max(city.junctions, key=lambda j: len(j.groups))
    pairs = conflicting_groups(junction, roads)
    for one, other in itertools.combinations(junction.groups, 2):
        if frozenset((one.name, other.name)) in pairs:
            continue
        for a, b in itertools.product(one.movements, other.movements):
            first, second = roads.lane(a.lane).points, roads.lane(b.lane).points
            away = np.hypot(*(first[:, None, :] - second[None, :, :]).transpose(2, 0, 1))
            assert away.min() > 0.25


def test_its_plans_are_safe_for_all_junctions(city):
    part = TrafficPart(city)
    assert len(part.step(0, [])) >= len(city.junctions)


def test_lanes_side_by_side_leave_room_for_two_cars(city, roads):
    streets = [lane for lane in city.lanes if lane.segments[0].length_m and len(lane.next) > 0]
    for a, b in itertools.combinations([roads.lane(lane.name) for lane in streets], 2):
        if math.cos(a.at(0.0).yaw - b.at(0.0).yaw) < -0.9:
            away = np.hypot(*(a.points[:, None, :] - b.points[None, :, :]).transpose(2, 0, 1))
            assert away.min() > 0.175 + 0.05


def test_spawns_stand_free_of_each_other_and_of_junctions(city, roads):
    poses = [roads.spawn_pose(spawn.name) for spawn in city.spawns]
    for a, b in itertools.combinations(poses, 2):
        assert math.hypot(a.x - b.x, a.y - b.y) > 0.25
    lines = {line.lane: line.at_m for line in city.stop_lines}
    for spawn in city.spawns:
        assert spawn.at_m + 0.23 < lines.get(spawn.lane, math.inf)


def test_cars_are_spread_over_all_streets_before_one_gets_a_second(city):
    first = [spawn.lane for spawn in city.spawns]
    streets = len(set(first))
    assert len(set(first[:streets])) == streets


def test_it_can_be_drawn(city):
    assert draw_svg(city).count('class="lane"') == len(city.lanes)


def test_a_place_is_found_on_the_lane_that_runs_there(city, roads):
    for lane in city.lanes[::11]:
        middle = roads.length_of(lane.name) / 2.0
        found = roads.nearest(roads.lane(lane.name).at(middle))
        assert math.hypot(found.lateral, 0.0) < 1e-6


def test_lanes_are_laid_only_when_somebody_asks():
    roads = Roads(grid_city(4, 4))
    lanes = roads.lanes
    assert len(lanes) == len(roads.city_map.lanes)
    assert not lanes._laid
    assert roads.lane(roads.city_map.lanes[0].name).length_m > 0.0
    assert len(lanes._laid) == 1
