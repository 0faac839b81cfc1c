import msgspec

from scm.maps.conflicts import conflicting_groups
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import Conflict


def test_the_two_ways_over_the_crossing_conflict():
    city_map = load_map("driving_school")
    assert conflicting_groups(city_map.junctions[0], Roads(city_map)) == {
        frozenset({"south_east", "south_west"})
    }


def test_ways_that_stay_apart_do_not_conflict():
    city_map = load_map("driving_school")
    junction = city_map.junctions[0]
    east, west = junction.groups
    apart = msgspec.structs.replace(
        junction,
        groups=(
            msgspec.structs.replace(east, movement=Conflict(lane="east_loop", from_m=0.5, to_m=1)),
            msgspec.structs.replace(west, movement=Conflict(lane="west_loop", from_m=0.5, to_m=1)),
        ),
    )
    assert conflicting_groups(apart, Roads(city_map)) == frozenset()


def test_lanes_that_only_brush_each_other_conflict():
    city_map = load_map("driving_school")
    junction = city_map.junctions[0]
    east, west = junction.groups
    brushing = msgspec.structs.replace(
        junction,
        groups=(
            msgspec.structs.replace(
                east, movement=Conflict(lane="crossing_south_east", from_m=0.41, to_m=0.7)
            ),
            west,
        ),
    )
    assert conflicting_groups(brushing, Roads(city_map)) == {
        frozenset({"south_east", "south_west"})
    }
