"""Promises of SPaT are kept through random plan changes, and odd steps do no harm."""

import random

import pytest

from scm.errors import PlanError
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.program import STEP_NS

S = STEP_NS
CROSSING = Program(
    ("a", "b", "c"),
    (GroupTimes(29 * S, 6 * S, 46 * S), GroupTimes(20 * S, 6 * S, 30 * S), GroupTimes(S, S, S)),
    frozenset({frozenset("ab"), frozenset("bc"), frozenset("ac")}),
)


def run(controller, steps, start_ns=0, jitter=None):
    for k in range(steps):
        now_ns = start_ns + k * S + (jitter() if jitter else 0)
        controller.step(now_ns)
        yield controller.spat(now_ns)


class Promises:
    """Checks each sample of each group against what was promised before in the same interval."""

    def __init__(self):
        self.last = {}
        self.kept = 0

    def check(self, spat):
        for group in spat.groups:
            before = self.last.get(group.group)
            if before is not None and before.colour == group.colour:
                assert group.since_ns == before.since_ns
                assert group.min_end_ns >= before.min_end_ns
                assert group.max_end_ns <= before.max_end_ns
            elif before is not None:
                assert group.colour == before.next_colour
                assert before.min_end_ns <= spat.t_ns <= before.max_end_ns
                self.kept += 1
            self.last[group.group] = group


@pytest.mark.parametrize("late_ms", [0, 40, 90])
def test_no_promise_is_broken_by_random_plan_changes(late_ms):
    dice = random.Random(late_ms)
    controller = Controller("x", CROSSING, "calm")
    promises, plans = Promises(), set()
    for spat in run(controller, 12_000, jitter=lambda: dice.randrange(late_ms + 1) * 10**6):
        promises.check(spat)
        plans.add(spat.plan)
        if dice.random() < 0.005:
            controller.request_plan(dice.choice(["calm", "brisk"]))
    assert promises.kept > 250
    assert plans == {"calm", "brisk"}
    assert controller.late_steps == 0


def test_it_starts_all_red_until_the_longest_clearance_is_over():
    controller = Controller("x", CROSSING, "calm")
    spats = list(run(controller, 60))
    greens = [s.t_ns // S for s in spats if any(g.colour == "green" for g in s.groups)]
    assert greens[0] == 47
    assert spats[0].mode == "start"
    assert spats[47].mode == "plan"
    assert spats[0].groups[0].min_end_ns == 47 * S


def test_a_plan_changes_when_the_cycle_ends_and_can_be_taken_back():
    controller = Controller("x", CROSSING, "brisk")
    list(run(controller, 60))
    controller.request_plan("calm")
    assert (controller.plan, controller.pending) == ("brisk", "calm")
    controller.request_plan("brisk")
    assert controller.pending == ""
    controller.request_plan("calm")
    seen = [s.plan for s in run(controller, 400, 60 * S)]
    assert seen[0] == "brisk"
    assert seen[-1] == "calm"
    assert controller.pending == ""


def test_an_unknown_plan_is_refused_with_the_nearest_name():
    controller = Controller("x", CROSSING, "calm")
    with pytest.raises(PlanError, match=r"junction x: no plan 'brisc' \(did you mean 'brisk'"):
        controller.request_plan("brisc")


def test_flash_is_shown_at_once_promises_nothing_and_ends_through_all_red():
    controller = Controller("x", CROSSING, "calm")
    list(run(controller, 60))
    controller.flash("test", on=True)
    controller.flash("other", on=True)
    spat = next(run(controller, 1, 60 * S))
    assert {g.colour for g in spat.groups} == {"flashing_red"}
    assert (spat.mode, spat.groups[0].max_end_ns) == ("flash", None)
    controller.flash("test", on=False)
    assert next(run(controller, 1, 61 * S)).mode == "flash"
    controller.flash("other", on=False)
    spats = list(run(controller, 48, 62 * S))
    assert all(g.colour == "red" for s in spats[:47] for g in s.groups)
    assert spats[47].groups[0].colour == "green"


def test_a_frozen_controller_goes_on_later_with_every_time_kept():
    controller = Controller("x", CROSSING, "brisk")
    list(run(controller, 50))
    spats = list(run(controller, 600, 50 * S + 20 * S))
    assert controller.late_steps == 1
    yellows = [s.t_ns for s in spats if s.groups[0].colour == "yellow"]
    first = [t for t in yellows if t < yellows[0] + 20 * S]
    assert len(first) == 6


def test_a_green_that_started_late_keeps_its_least_time():
    controller = Controller("x", CROSSING, "brisk")
    list(run(controller, 47))
    controller.step(49 * S)
    assert controller.late_steps == 0
    assert controller.spat(49 * S).groups[0].min_end_ns == (49 + 29) * S


def test_a_red_promise_narrows_when_the_next_cycle_has_begun():
    controller = Controller("x", CROSSING, "brisk")
    spats = list(run(controller, 60))
    wide, narrow = spats[0].groups[1], spats[50].groups[1]
    assert wide.min_end_ns == narrow.min_end_ns
    assert wide.max_end_ns > narrow.max_end_ns == narrow.min_end_ns + 2 * S
