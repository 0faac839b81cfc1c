"""A junction's program comes from its map, in whole steps and rounded up."""

import msgspec
import pytest

from scm.clock import NS_PER_MS
from scm.errors import PlanError
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.signals.program import program_of, whole_steps_ns

MAP = load_map("driving_school")


def changed(**fields):
    city_map = msgspec.structs.replace(MAP, **fields)
    return city_map.junctions[0], Roads(city_map)


def test_times_are_whole_steps_and_never_shorter():
    assert whole_steps_ns(0.51) == 600 * NS_PER_MS
    assert whole_steps_ns(0.6) == 600 * NS_PER_MS


def test_the_driving_school_has_two_groups_in_conflict():
    program = program_of(MAP.junctions[0], Roads(MAP))
    assert program.groups == ("south_east", "south_west")
    assert program.conflicts == {frozenset(program.groups)}


def test_clearance_is_the_way_out_at_the_slowest_speed():
    line, movement = MAP.stop_lines[0], MAP.junctions[0].groups[0].movement
    program = program_of(MAP.junctions[0], Roads(MAP))
    way_m = movement.to_m - line.at_m
    assert program.times[0].clearance == whole_steps_ns((way_m + 0.30) / 0.217)


def test_a_stop_line_on_the_lane_before_adds_what_is_left_of_that_lane():
    line = msgspec.structs.replace(MAP.stop_lines[0], lane="west_loop", at_m=2.0)
    junction, roads = changed(stop_lines=(line, *MAP.stop_lines[1:]))
    way_m = roads.lane("west_loop").length_m - 2.0 + junction.groups[0].movement.to_m
    assert program_of(junction, roads).times[0].clearance == whole_steps_ns((way_m + 0.3) / 0.217)


def test_a_group_without_a_stop_line_is_refused_by_name():
    with pytest.raises(PlanError, match=r"'south_east' has no stop line on map driving_school"):
        program_of(*changed(stop_lines=MAP.stop_lines[1:]))


def test_a_stop_line_that_does_not_lead_to_its_movement_is_refused():
    line = msgspec.structs.replace(MAP.stop_lines[0], lane="crossing_south_west")
    with pytest.raises(PlanError, match="does not lead to 'crossing_south_east'"):
        program_of(*changed(stop_lines=(line, *MAP.stop_lines[1:])))


def slower(name, limit_mps):
    return tuple(
        msgspec.structs.replace(lane, speed_limit_mps=limit_mps) if lane.name == name else lane
        for lane in MAP.lanes
    )


def test_the_farthest_of_several_stop_lines_counts():
    far = msgspec.structs.replace(MAP.stop_lines[0], name="far", at_m=0.1)
    for lines in ((far, *MAP.stop_lines), (*MAP.stop_lines, far)):
        junction, roads = changed(stop_lines=lines)
        way_m = junction.groups[0].movement.to_m - 0.1
        clearance = program_of(junction, roads).times[0].clearance
        assert clearance == whole_steps_ns((way_m + 0.3) / 0.217)


@pytest.mark.parametrize("slow", ["west_loop", "crossing_south_east"])
def test_the_lowest_speed_limit_on_the_way_counts(slow):
    before = msgspec.structs.replace(MAP.stop_lines[0], name="before", lane="west_loop", at_m=2.0)
    lines = (before, MAP.stop_lines[1])
    junction, roads = changed(stop_lines=lines, lanes=slower(slow, 0.1))
    way_m = roads.lane("west_loop").length_m - 2.0 + junction.groups[0].movement.to_m
    assert program_of(junction, roads).times[0].clearance == whole_steps_ns((way_m + 0.3) / 0.1)
