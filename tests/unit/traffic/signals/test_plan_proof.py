"""The search for plans finds what a plan says and a junction does not do, however steps come."""

import pytest

from scm.errors import PlanError
from scm.traffic.signals import kernel
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import Stage, TimedStage, Timetable, timetable
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.proof.plan_proof import prove_plan

S = STEP_NS
PROGRAM = Program(
    ("a", "b"),
    (GroupTimes(5 * S, 2 * S, 4 * S), GroupTimes(4 * S, 2 * S, 3 * S)),
    frozenset({frozenset("ab")}),
)
CYCLE = (Stage(("a",), 6 * S), Stage(("b",), 5 * S, 2 * S))


def test_a_plan_with_room_between_its_stages_is_proven_and_counted():
    found = prove_plan(kernel, PROGRAM, timetable("rush", CYCLE, PROGRAM))
    assert found.plan_states > found.states > 10
    assert found.plan_transitions > found.plan_states
    assert found.transitions > found.states


def test_extra_red_makes_the_cycle_longer_by_just_that():
    plain = timetable("rush", (CYCLE[0], Stage(("b",), 5 * S)), PROGRAM)
    assert timetable("rush", CYCLE, PROGRAM).length_ns - plain.length_ns == 2 * S


@pytest.mark.parametrize("missing", [2, 3])
def test_a_gap_too_short_for_late_steps_is_found(missing):
    good = timetable("rush", CYCLE, PROGRAM)
    first, second = good.timed_stages
    start_ns = second.start_ns - missing * S
    early = TimedStage(second.groups, start_ns, second.end_ns)
    tight = Timetable("rush", (first, early), good.length_ns)
    with pytest.raises(PlanError, match=r"group 'b' is red at .* where its green should be"):
        prove_plan(kernel, PROGRAM, tight)


def test_a_green_that_a_late_step_could_miss_is_refused():
    good = timetable("rush", CYCLE, PROGRAM)
    short = TimedStage(good.timed_stages[0].groups, 0, S)
    with pytest.raises(PlanError, match="too short for late steps"):
        prove_plan(
            kernel, PROGRAM, Timetable("rush", (short, good.timed_stages[1]), good.length_ns)
        )


RINGS = Program(
    ("a", "b", "c", "d"),
    (
        GroupTimes(5 * S, 2 * S, 4 * S),
        GroupTimes(4 * S, 2 * S, 3 * S),
        GroupTimes(3 * S, S, 2 * S),
        GroupTimes(3 * S, 2 * S, 5 * S),
    ),
    frozenset({frozenset("ab"), frozenset("cd")}),
)
ROUND = tuple(Stage(tuple(groups), 6 * S) for groups in ("ac", "ad", "bd", "bc"))


class Blinking:
    """The kernel, but who is green ends when its least time is over, and begins again."""

    start = staticmethod(kernel.start)

    @staticmethod
    def step(program, state, wishes, dt, *, flash=False):
        spent = {
            name
            for name, times, group in zip(program.groups, program.times, state, strict=True)
            if group == (kernel.Phase.GREEN, times.min_green)
        }
        return kernel.step(program, state, set(wishes) - spent, dt, flash=flash)


def test_a_plan_is_proven_whose_stages_overlap_all_the_way_round():
    table = timetable("round", ROUND, RINGS)
    assert table.into(table) == {"c"}
    found = prove_plan(kernel, RINGS, table)
    assert found.plan_states > 2 * table.length_ns // S


def test_a_green_that_does_not_last_from_stage_to_stage_is_found():
    with pytest.raises(PlanError, match=r"group '[ac]' is yellow at .* where its green should be"):
        prove_plan(Blinking(), RINGS, timetable("round", ROUND, RINGS))


@pytest.mark.parametrize("missing", [2, 3])
def test_a_cycle_that_leaves_no_room_for_another_plan_at_its_end_is_found(missing):
    table = timetable("round", ROUND, RINGS)
    tight = Timetable("round", table.timed_stages, table.length_ns - missing * S)
    with pytest.raises(PlanError, match="its cycle ends before all who went last are clear"):
        prove_plan(kernel, RINGS, tight)


class Careless:
    """The kernel without its guard: whoever is wished for begins."""

    start = staticmethod(kernel.start)

    @staticmethod
    def step(program, state, wishes, dt, *, flash=False):
        alone = program._replace(conflicts=frozenset())
        return kernel.step(alone, state, wishes, dt, flash=flash)


def test_no_plan_is_proven_over_a_kernel_that_is_not_safe():
    with pytest.raises(PlanError, match="unsafe: group"):
        prove_plan(Careless(), PROGRAM, timetable("rush", CYCLE, PROGRAM))
