"""Junctions in a row turn green one after the other, as fast as cars come."""

import pytest

from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.traffic.signals.green_wave import Wave, dwell_ns, links_of, stretch
from scm.traffic.signals.junction_timings import timetables_of
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.plan import load_timetable
from scm.traffic.signals.program import STEP_NS, program_of
from scm.traffic.signals.timetables import Timetables
from scm.traffic.signals.timing import NIGEL

CITY = load_map("grid:3x2")
ROADS = Roads(CITY)
PROGRAMS = {j.name: program_of(j, ROADS) for j in CITY.junctions}


def test_a_link_runs_from_line_to_line_and_takes_as_long_as_the_slowest_drives():
    link = next(
        one
        for one in links_of(CITY, ROADS, NIGEL)
        if (one.start.name, one.end.name) == ("j1_0_e", "j1_1_n")
    )
    turn_m = ROADS.length_of("j1_0_en")
    way_m = 0.14 + turn_m + link.end.at_m
    assert link.travel_s == pytest.approx(way_m / NIGEL.slow_mps, rel=1e-3)


def test_all_junctions_share_a_cycle_and_follow_each_other_by_their_links():
    tables = timetables_of(CITY, ROADS, PROGRAMS, NIGEL)
    assert {t["calm"][0].length_ns for t in tables.values()} == {
        max(load_timetable("calm", program).length_ns for program in PROGRAMS.values())
    }
    links = links_of(CITY, ROADS, NIGEL)

    def in_step(link):
        start, end = (tables[line.junction]["calm"] for line in (link.start, link.end))
        leaves = start[1].offset_ns + start[0].first_start_ns(link.start.group)
        comes = end[1].offset_ns + end[0].first_start_ns(link.end.group)
        late = (comes - leaves - round(link.travel_s * 1e9)) % start[1].length_ns
        return late == 0

    assert sum(map(in_step, links)) >= len(PROGRAMS) - 1


def test_a_stretched_timetable_keeps_its_order_and_reaches_its_length():
    table = load_timetable("calm", next(iter(PROGRAMS.values())))
    longer = stretch(table, table.length_ns + 70 * STEP_NS)
    assert longer.length_ns == table.length_ns + 70 * STEP_NS
    before = 0
    for old, new in zip(table.timed_stages, longer.timed_stages, strict=True):
        assert new.end_ns - new.start_ns >= old.end_ns - old.start_ns
        assert new.start_ns >= before
        before = new.end_ns


def test_a_cycle_dwells_until_it_is_in_step_and_then_stays():
    table = load_timetable("calm", next(iter(PROGRAMS.values())))
    wave = Wave(table.length_ns, 100 * STEP_NS)
    runs = Timetables({"calm": (table, wave)}, "calm")
    runs.clear(0, 47 * STEP_NS)
    began = []
    for _ in range(4):
        runs.next_cycle()
        began.append(runs.cycle.began_ns % table.length_ns)
    assert began == [47 * STEP_NS, 100 * STEP_NS, 100 * STEP_NS, 100 * STEP_NS]


def test_who_is_hardly_late_does_not_dwell_for_a_whole_cycle():
    assert dwell_ns(Wave(60 * 10**9, 0), 5 * 10**8) == 0
    assert dwell_ns(Wave(60 * 10**9, 0), 50 * 10**9) == 10 * 10**9
    assert dwell_ns(None, 7) == 0


def test_a_single_junction_follows_nobody():
    alone = load_map("driving_school")
    part = TrafficPart(alone)
    assert part.step(0, [])
    programs = {"crossing": program_of(alone.junctions[0], Roads(alone))}
    assert timetables_of(alone, Roads(alone), programs, NIGEL)["crossing"]["calm"][1] is None
