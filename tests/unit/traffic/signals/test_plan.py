"""A plan's cycle is laid out with yellow and clearance between, or refused with every reason."""

import pytest

from scm.errors import PlanError
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import Stage, load_timetable, plan_names, stages, timetable
from scm.traffic.signals.program import STEP_NS

S = STEP_NS


def program(*conflicts):
    times = (GroupTimes(3 * S, 2 * S, 4 * S), GroupTimes(5 * S, 1 * S, 1 * S), GroupTimes(S, S, S))
    return Program(("a", "b", "c"), times, frozenset(frozenset(pair) for pair in conflicts))


def test_groups_that_fit_together_share_a_stage():
    assert stages(program("ab", "bc")) == (("a", "c"), ("b",))


def test_slots_follow_each_other_after_the_longest_yellow_and_clearance_and_three_steps():
    table = timetable("p", (Stage(("a", "c"), 3 * S), Stage(("b",), 6 * S)), program("ab", "bc"))
    assert [(slot.start_ns // S, slot.end_ns // S) for slot in table.timed_stages] == [
        (0, 3),
        (12, 18),
    ]
    assert table.length_ns == 23 * S


def test_a_timetable_wishes_its_slots_and_nothing_between():
    table = timetable("p", (Stage(("a", "c"), 3 * S), Stage(("b",), 6 * S)), program("ab", "bc"))
    assert table.requested(0) == {"a", "c"}
    assert table.requested(3 * S) == frozenset()
    assert table.requested(12 * S) == {"b"}
    assert table.first_start_ns("b") == 12 * S
    assert table.green_of("a", 3 * S) is None
    assert table.green_of("b", 0).start_ns == 12 * S


OVERLAP = (
    Stage(("a", "c"), 3 * S),
    Stage(("b", "c"), 6 * S),
    Stage(("c",), S),
    Stage(("a",), 4 * S),
)


def test_who_is_in_two_stages_that_follow_each_other_stays_green_between_them():
    table = timetable("p", OVERLAP, program("ab"))
    assert [slot.start_ns // S for slot in table.timed_stages] == [0, 12, 23, 29]
    assert [table.requested(at * S) for at in (2, 3, 11)] == [{"a", "c"}, {"c"}, {"c"}]
    assert table.requested(28 * S) == frozenset()
    assert table.greens_of("c") == [(0, 24 * S)]
    assert table.greens_of("a") == [(0, 3 * S), (29 * S, 33 * S)]
    assert table.green_of("c", 11 * S) == (0, 24 * S)


def test_who_only_joins_waits_for_nobody():
    cycle = (Stage(("a",), 3 * S, S), Stage(("a", "c"), 4 * S), Stage(("b",), 5 * S))
    table = timetable("p", cycle, program("ab", "bc"))
    assert [slot.start_ns // S for slot in table.timed_stages] == [0, 4, 17]
    assert table.requested(3 * S) == {"a"}


def test_over_the_end_of_a_cycle_goes_on_who_begins_the_next_and_room_is_left_for_all():
    table = timetable("p", OVERLAP, program("ab"))
    other = timetable("q", (Stage(("b", "c"), 6 * S), Stage(("a",), 3 * S)), program("ab"))
    assert table.length_ns == (33 + 9) * S
    assert (table.into(table), table.into(other)) == ({"a"}, frozenset())
    assert table.requested(41 * S, frozenset("a")) == {"a"}
    assert table.requested(41 * S) == table.requested(42 * S, frozenset("a")) == frozenset()


def test_every_problem_of_a_cycle_is_named_at_once():
    cycle = (Stage(("a", "b"), S), Stage(("x",), S), Stage((), S))
    with pytest.raises(PlanError) as refusal:
        timetable("bad", cycle, program("ab"))
    text = str(refusal.value)
    assert "'a' and 'b' conflict but share a stage" in text
    assert "green 0.1 s, expected at least 0.5 s" in text
    assert "('x',): expected groups of" in text
    assert "stage ()" in text
    assert "group 'c' is never green" in text


def test_an_unknown_plan_is_refused_with_the_nearest_name():
    with pytest.raises(PlanError, match=r"did you mean 'calm'"):
        load_timetable("clam", program("ab"))


def test_two_plans_are_shipped():
    assert plan_names() == ["brisk", "calm"]
