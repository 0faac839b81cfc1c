"""The monitor's card agrees with the controller's program without sharing its code."""

import msgspec
import pytest

from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.records.city_map import Lane, Segment
from scm.traffic.monitor.conflict_table import conflict_table_of, table_hash
from scm.traffic.signals.program import program_of

MAP = load_map("driving_school")
CARD = conflict_table_of(MAP, MAP.junctions[0])


def test_the_card_asks_for_no_more_than_the_controller_gives_and_for_most_of_it():
    program = program_of(MAP.junctions[0], Roads(MAP))
    for group, times in zip(CARD.groups, program.times, strict=True):
        assert 0.9 * times.yellow <= group.yellow_ns <= times.yellow
        assert 0.9 * times.clearance <= group.clearance_ns <= times.clearance
        assert 0.5 * times.min_green <= group.green_ns <= times.min_green


def test_the_card_knows_the_crossing_as_the_only_conflict():
    assert CARD.conflicts == (("south_east", "south_west"),)


@pytest.mark.parametrize(
    ("apart_m", "conflicts"), [(0.26, ()), (0.25, (("south_east", "south_west"),))]
)
def test_movements_conflict_when_they_come_closer_than_a_lane_is_wide(apart_m, conflicts):
    lanes = [
        Lane(
            name=name,
            width_m=0.257,
            start=(0.0, y_m, 0.0),
            segments=(Segment(length_m=2.0),),
            speed_limit_mps=0.25,
        )
        for name, y_m in (("crossing_south_east", 0.0), ("crossing_south_west", apart_m))
    ]
    city_map = msgspec.structs.replace(MAP, lanes=tuple(lanes))
    assert conflict_table_of(city_map, MAP.junctions[0]).conflicts == conflicts


def test_a_stop_line_on_another_lane_or_none_still_gives_a_clearance():
    line = msgspec.structs.replace(MAP.stop_lines[0], lane="west_loop", at_m=2.0)
    city_map = msgspec.structs.replace(MAP, stop_lines=(line,))
    first, second = conflict_table_of(city_map, MAP.junctions[0]).groups
    movement = MAP.junctions[0].groups[0].movement
    loop_m = 0.5145 * 4.014257
    assert first.clearance_ns == pytest.approx((loop_m - 2.0 + movement.to_m + 0.3) / 0.217e-9)
    assert second.clearance_ns == pytest.approx((1.08 - 0.41 + 0.3) / 0.217e-9)


def test_the_hash_changes_with_anything_on_the_card():
    other = msgspec.structs.replace(CARD, conflicts=())
    assert table_hash(CARD) == table_hash(conflict_table_of(MAP, MAP.junctions[0]))
    assert table_hash(other) != table_hash(CARD)
    assert len(table_hash(CARD)) == 12
