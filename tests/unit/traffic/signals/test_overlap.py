"""Stages that share a group: it stays green between them, as promised, and the monitor agrees."""

import random

import pytest

from scm.traffic.monitor.checks import Monitor
from scm.traffic.monitor.conflict_table import ConflictTable, GroupLimits
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import Stage, load_timetable, timetable
from scm.traffic.signals.program import STEP_NS

S = STEP_NS
RINGS = Program(
    ("a", "b", "c", "d"),
    (
        GroupTimes(25 * S, 6 * S, 30 * S),
        GroupTimes(20 * S, 6 * S, 20 * S),
        GroupTimes(15 * S, 5 * S, 10 * S),
        GroupTimes(20 * S, 6 * S, 40 * S),
    ),
    frozenset({frozenset("ab"), frozenset("cd")}),
)
START = 41 * S  # when the first cycle begins
TABLES = {name: (load_timetable(name, RINGS), None) for name in ("calm", "brisk")}


def table(name, *stages, green=30):
    return timetable(name, tuple(Stage(tuple(groups), green * S) for groups in stages), RINGS)


ROUND = table("round", "ac", "ad", "bd", "bc")


def runs(*tables, plan=None, **more):
    known = {**TABLES, **{one.plan: (one, None) for one in tables}}
    return Controller("x", RINGS, plan or tables[0].plan, tables=known, **more)


def run(controller, steps, start=0):
    """Step on; yield each step with the groups by name."""
    for now_ns in range(start * S, (start + steps) * S, S):
        controller.step(now_ns)
        yield now_ns, {group.group: group for group in controller.spat(now_ns).groups}


def greens(samples, group):
    """Return when a group was green, as `[from, until)` in steps."""
    found = []
    for now_ns, groups in samples:
        if groups[group].colour == "green":
            if not found or found[-1][1] != now_ns // S:
                found.append([now_ns // S, now_ns // S])
            found[-1][1] = now_ns // S + 1
    return [tuple(one) for one in found]


def in_cycle(*greens_ns, cycle=0, of=ROUND):
    begin = START + cycle * of.length_ns
    return [((begin + a) // S, (begin + b) // S) for a, b in greens_ns]


def test_a_group_of_two_stages_is_green_through_both_and_all_between_within_a_cycle():
    samples = list(run(runs(ROUND), (START + ROUND.length_ns) // S))
    first, second, third, last = ROUND.timed_stages
    assert greens(samples, "a") == in_cycle((0, second.end_ns))
    assert greens(samples, "d") == in_cycle((second.start_ns, third.end_ns))
    assert greens(samples, "b") == in_cycle((third.start_ns, last.end_ns))
    assert greens(samples, "c")[0] == in_cycle((0, first.end_ns))[0]


def test_a_group_of_the_last_and_the_first_stage_stays_green_over_the_end_of_the_cycle():
    samples = list(run(runs(ROUND), (START + 2 * ROUND.length_ns) // S))
    begin, end = ROUND.timed_stages[-1].start_ns, ROUND.length_ns + ROUND.timed_stages[0].end_ns
    assert greens(samples, "c")[1] == in_cycle((begin, end))[0]


def test_its_end_is_promised_through_the_next_stage_from_the_begin():
    samples = list(run(runs(ROUND), (START + ROUND.length_ns) // S))
    for group, end_ns in (("a", ROUND.timed_stages[1].end_ns), ("d", ROUND.timed_stages[2].end_ns)):
        told = [groups[group] for _, groups in samples if groups[group].colour == "green"]
        assert {one.min_end_ns for one in told} == {START + end_ns}
        assert {one.likely_end_ns for one in told} == {START + end_ns}
        assert {one.max_end_ns for one in told} == {START + end_ns + 2 * S}
    last = [groups["c"] for _, groups in samples][-1]
    assert last.min_end_ns == START + ROUND.length_ns + ROUND.timed_stages[0].end_ns


def test_a_green_that_reaches_the_last_stage_is_promised_no_further_than_any_plan_has_it():
    long = table("long", "bd", "ad", "ac")
    samples = list(run(runs(long, ROUND), (START + long.length_ns) // S))
    told = {now_ns - START: groups["a"] for now_ns, groups in samples}
    begin_ns, settled_ns = long.timed_stages[1].start_ns, long.timed_stages[-1].start_ns
    ends_ns = START + long.timed_stages[-1].end_ns
    for at_ns in (begin_ns, settled_ns - S):
        assert told[at_ns].colour == "green"
        assert (told[at_ns].min_end_ns, told[at_ns].likely_end_ns) == (ends_ns, ends_ns)
        assert (
            told[at_ns].max_end_ns == START + long.length_ns + ROUND.timed_stages[1].end_ns + 2 * S
        )
    assert told[settled_ns].max_end_ns == ends_ns + 2 * S
    assert told[long.timed_stages[-1].end_ns].colour == "yellow"


def test_a_plan_that_is_asked_for_once_it_is_settled_who_goes_on_comes_a_cycle_later():
    controller = runs(ROUND)
    settled = (START + ROUND.timed_stages[-1].start_ns) // S
    list(run(controller, settled + 1))
    controller.request_plan("calm")
    assert (controller.plan, controller.pending) == ("round", "calm")
    steps = ROUND.length_ns // S
    samples = list(run(controller, steps, settled + 1))
    assert (controller.plan, controller.pending) == ("round", "calm")
    assert greens(samples, "c")[0][1] * S == START + ROUND.length_ns + ROUND.timed_stages[0].end_ns
    list(run(controller, 60, settled + 1 + steps))
    assert (controller.plan, controller.pending) == ("calm", "")


def test_who_takes_a_plan_back_that_is_settled_gets_the_one_before_a_cycle_later():
    controller = runs(ROUND, table("other", "bc", "ad"))
    list(run(controller, 50))
    controller.request_plan("other")
    settled = (START + ROUND.timed_stages[-1].start_ns) // S
    list(run(controller, settled - 49, 50))
    controller.request_plan("round")
    assert (controller.plan, controller.pending) == ("round", "round")
    list(run(controller, 100, settled + 1))
    assert (controller.plan, controller.pending) == ("other", "round")
    list(run(controller, 200, settled + 101))
    assert (controller.plan, controller.pending) == ("round", "")


def test_another_policy_waits_for_who_goes_on_and_comes_within_two_cycles():
    controller = runs(ROUND)
    settled = (START + ROUND.timed_stages[-1].start_ns) // S
    list(run(controller, settled + 1))
    controller.request_plan("actuated")
    cycle = ROUND.length_ns // S
    list(run(controller, cycle, settled + 1))
    assert controller.policy == "fixed"
    list(run(controller, cycle, settled + 1 + cycle))
    assert controller.policy == "actuated"


def test_who_goes_on_stays_green_over_a_pause_of_the_controller():
    through = table("through", "ac", "bd", "ad", "ac")
    controller = runs(through)
    paused = (START + through.timed_stages[2].start_ns) // S + 10
    assert list(run(controller, paused))[-1][1]["a"].colour == "green"
    late = (START + through.timed_stages[-1].end_ns) // S + 50 - paused
    samples = list(run(controller, through.length_ns // S, paused + late))
    begin = samples[0][0] // S
    (until,) = [until for since, until in greens(samples, "a") if since == begin]
    assert until - late > (START + through.length_ns) // S
    assert controller.late_steps == 1


def test_a_group_of_all_stages_stays_green_and_nobody_is_told_when_it_ends():
    alone = Program(
        ("a", "c", "d"), RINGS.times[:1] + RINGS.times[2:], frozenset({frozenset("cd")})
    )
    always = timetable("always", (Stage(("a", "c"), 30 * S), Stage(("a", "d"), 30 * S)), alone)
    controller = Controller("x", alone, "always", tables={"always": (always, None)})
    samples = list(run(controller, (START + 4 * always.length_ns) // S))
    told = [(now_ns, groups["a"]) for now_ns, groups in samples if now_ns >= START]
    assert {one.colour for _, one in told} == {"green"}
    assert {one.max_end_ns for _, one in told} == {None}
    assert all(one.min_end_ns - now_ns >= 20 * S for now_ns, one in told)


def conflict_table_of(program):
    pairs = zip(program.groups, program.times, strict=True)
    return ConflictTable(
        junction="x",
        groups=tuple(
            GroupLimits(name=n, green_ns=t.min_green, yellow_ns=t.yellow, clearance_ns=t.clearance)
            for n, t in pairs
        ),
        conflicts=tuple((min(pair), max(pair)) for pair in program.conflicts),
    )


def later(end_ns, before_ns):
    """Say whether a latest end moved later; None: not known, which is the latest of all."""
    return before_ns is not None and (end_ns is None or end_ns > before_ns)


def kept(before, group, now_ns):
    """Say whether what was told of a group is true of what it shows next."""
    if before.colour == group.colour:
        return group.min_end_ns >= before.min_end_ns and not later(
            group.max_end_ns, before.max_end_ns
        )
    return before.min_end_ns <= now_ns and not later(now_ns, before.max_end_ns)


def drawn(dice, number):
    """Draw a plan whose stages share groups, with every group in one of them."""
    while True:
        stages = [
            Stage((dice.choice("ab"), dice.choice("cd"))[: dice.choice((1, 2, 2))], n * S)
            for n in (dice.randrange(25, 70) for _ in range(dice.randrange(2, 6)))
        ]
        if {group for stage in stages for group in stage.groups} == set("abcd"):
            return timetable(f"drawn{number}", tuple(stages), RINGS)


@pytest.mark.parametrize("seed", range(3))
def test_no_promise_is_broken_and_no_fault_seen_while_overlapping_plans_come_and_go(seed):
    dice = random.Random(seed)
    controller, monitor = runs(ROUND), Monitor(conflict_table_of(RINGS), 0)
    last, ran, ended = {}, set(), 0
    for step in range(9000):
        now_ns = step * S + dice.randrange(90) * 10**6
        controller.step(now_ns)
        spat = controller.spat(now_ns)
        monitor.see(spat, now_ns)
        assert monitor.fault is None, monitor.detail
        ran.add(spat.plan)
        for group in spat.groups:
            before = last.get(group.group)
            if before is not None and spat.mode != "flash":
                assert kept(before, group, now_ns), (before, group, now_ns)
                ended += before.colour != group.colour
            last[group.group] = group
        chance = dice.random()
        if chance < 0.005:
            controller.request_custom_plan(drawn(dice, dice.randrange(3)), None)
        elif chance < 0.008:
            controller.request_plan(dice.choice(["calm", "round", "brisk", "actuated"]))
    assert ended > 100
    assert len(ran) >= 4
    assert controller.late_steps == 0
