"""Every policy keeps SPaT's promises, serves who waits, and does what wishes ask, in their time."""

import random

import pytest

from scm.clock import NS_PER_S
from scm.errors import PlanError
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.controller_state import Observations
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.kernel import GroupState, GroupTimes, Phase, Program
from scm.traffic.signals.policies import actuated
from scm.traffic.signals.policy import (
    JunctionView,
    PriorityCall,
    load_policy,
    policy_names,
    site_of,
)
from scm.traffic.signals.program import STEP_NS
from scm.v2x.messages.signal_request import SignalRequest

S = STEP_NS
TIMES = (GroupTimes(29 * S, 6 * S, 46 * S), GroupTimes(20 * S, 6 * S, 30 * S), GroupTimes(S, S, S))
CONFLICTS = frozenset({frozenset("ab"), frozenset("bc"), frozenset("ac")})
CROSSING = Program(("a", "b", "c"), TIMES, CONFLICTS)
MOVING = sorted(set(policy_names()) - {"flashing", "learned"})
THERE = Detector(call=True, extend=True, presence=True, near=1, queue=1)


class Drive:
    """A controller in steps, with cars that wait where they are put."""

    def __init__(self, policy, **more):
        self.controller = Controller("x", CROSSING, "brisk", policy=policy, **more)
        self.now_ns, self.waits, self.priority = 0, set(), ()
        self.last, self.kept = {}, 0

    def run(self, steps, each=None):
        spats = []
        for _ in range(steps):
            if each:
                each(self)
            cars = {name: THERE if name in self.waits else Detector() for name in "abc"}
            self.controller.step(self.now_ns, Observations(cars, True, self.priority))
            spats.append(self.controller.spat(self.now_ns))
            self.check(spats[-1])
            self.now_ns += S
        return spats

    def check(self, spat):
        for group in spat.groups:
            before = self.last.get(group.group)
            if before is not None and "flashing_red" not in (before.colour, group.colour):
                if before.colour == group.colour:
                    assert group.min_end_ns >= before.min_end_ns
                    if before.max_end_ns is not None:
                        assert group.max_end_ns <= before.max_end_ns
                else:
                    assert before.min_end_ns <= spat.t_ns
                    assert before.max_end_ns is None or spat.t_ns <= before.max_end_ns
                    self.kept += 1
            self.last[group.group] = group

    def wish(self, verb, *groups, expires_s=60.0, policy="", by="me"):
        request = SignalRequest(
            junction="x", verb=verb, groups=groups, by=by, expires_s=expires_s, policy=policy
        )
        self.controller.apply_override(request, self.now_ns)


def greens(spats, name):
    return [s.t_ns for s in spats for g in s.groups if g.group == name and g.colour == "green"]


@pytest.mark.parametrize("policy", policy_names())
def test_a_policy_says_what_it_is_for(policy):
    assert load_policy(policy).about


@pytest.mark.parametrize("policy", MOVING)
def test_promises_are_kept_while_cars_wishes_plans_and_policies_come_and_go(policy):
    dice = random.Random(3)
    drive = Drive(policy)

    def change(drive):
        if dice.random() < 0.02:
            drive.waits = {name for name in "abc" if dice.random() < 0.5}
        if dice.random() < 0.004:
            verb = dice.choice(["call", "hold", "force_off", "omit", "preempt", "clear"])
            try:
                drive.wish(verb, dice.choice("abc"), expires_s=dice.uniform(1.0, 40.0))
            except PlanError:
                drive.wish("clear")
        if dice.random() < 0.002:
            name = dice.choice(MOVING)
            drive.wish("policy", policy=name, expires_s=dice.uniform(5.0, 90.0))
        if dice.random() < 0.002:
            drive.controller.request_plan(dice.choice(["calm", "brisk"]))

    drive.run(6000, change)
    assert drive.kept > 100


@pytest.mark.parametrize("policy", MOVING)
def test_everybody_who_waits_is_served_and_served_again(policy):
    drive = Drive(policy)
    drive.waits = set("abc")
    spats = drive.run(3000)
    assert all(len(greens(spats, name)) > 20 for name in "abc")


@pytest.mark.parametrize("policy", ["actuated", "max_pressure", "priority"])
def test_who_is_alone_gets_green_at_once_and_keeps_it(policy):
    drive = Drive(policy)
    drive.run(100)
    drive.waits = {"b"}
    spats = drive.run(400)
    assert {g.colour for g in spats[-1].groups if g.group == "b"} == {"green"}
    assert len(greens(spats, "b")) > 250


@pytest.mark.parametrize("policy", ["actuated", "priority"])
def test_when_detectors_see_nothing_all_are_served_as_by_a_clock(policy):
    controller = Controller("x", CROSSING, "brisk", policy=policy)
    shown = set()
    for k in range(2000):
        controller.step(k * S)
        shown |= {g.group for g in controller.spat(k * S).groups if g.colour == "green"}
    assert shown == set("abc")


def test_a_green_that_goes_on_is_promised_long_enough_for_two_spatem():
    drive = Drive("actuated")
    drive.waits = {"a"}
    for spat in drive.run(600)[100:]:
        (group,) = (g for g in spat.groups if g.group == "a")
        assert group.colour == "green"
        assert group.min_end_ns - spat.t_ns >= 9 * S


def test_a_hold_that_would_break_a_promise_waits_until_it_does_not():
    drive = Drive("fixed")
    drive.run(60)
    drive.wish("hold", "a", expires_s=300.0)
    assert drive.controller.pending == "actuated"
    spats = drive.run(2400)
    assert spats[100].mode == "plan"
    assert spats[-1].mode == "adaptive"
    assert {g.colour for g in spats[-1].groups if g.group == "a"} == {"green"}
    after = drive.run(2000)
    assert after[-1].mode == "plan"
    assert drive.controller.overrides == ()


@pytest.mark.parametrize("policy", ["actuated", "max_pressure", "priority"])
def test_pre_emption_goes_before_a_hold(policy):
    drive = Drive(policy)
    drive.waits = {"a"}
    drive.run(300)
    drive.wish("hold", "a", expires_s=300.0)
    assert not greens(drive.run(300), "c")
    drive.wish("preempt", "c", expires_s=60.0)
    assert greens(drive.run(300), "c")


@pytest.mark.parametrize(("waiting", "ends"), [(1, False), (9, True)])
def test_a_green_waits_for_a_car_while_that_costs_those_who_stand_less_than_it_a_red(waiting, ends):
    site = site_of("x", CROSSING)
    state = (GroupState(Phase.GREEN, 29 * S), GroupState(Phase.RED), GroupState(Phase.RED))
    coming = Detector(call=True, near=1, arrivals_s=(5.0,))
    queue = Detector(call=True, extend=True, near=waiting, queue=waiting)
    view = JunctionView(0, S, state, {"a": coming, "b": queue}, sees=True)
    told = actuated.inputs_of(site, actuated.start(site), view)
    assert (0 not in told.inputs.calls) is ends


def test_an_omitted_group_is_left_out_and_comes_back():
    drive = Drive("actuated")
    drive.waits = set("abc")
    drive.run(300)
    drive.wish("omit", "b", expires_s=100.0)
    drive.run(200)
    assert not greens(drive.run(700), "b")
    assert greens(drive.run(700), "b")


def test_a_call_is_served_once_and_then_forgotten():
    drive = Drive("actuated")
    drive.waits = {"a"}
    drive.run(300)
    drive.wish("call", "c", expires_s=200.0)
    assert greens(drive.run(400), "c")
    assert drive.controller.overrides == ()


def test_flashing_is_a_policy_that_ends_through_all_red():
    drive = Drive("fixed")
    drive.run(60)
    drive.wish("policy", policy="flashing", expires_s=5.0)
    spats = drive.run(100)
    assert {g.colour for g in spats[0].groups} == {"flashing_red"}
    assert {g.colour for g in spats[60].groups} == {"red"}
    assert spats[60].mode == "start"


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        (("hold", "d"), r"no group 'd'"),
        (("hold",), "got none"),
        (("preempt", "a", "b"), "got 2, expected one"),
        (("omit", "a", "b", "c"), "all groups would be left out"),
        (("hold", "a", "b"), "can never be held together"),
    ],
)
def test_a_wish_that_cannot_be_taken_is_refused_in_words(wish, said):
    with pytest.raises(PlanError, match=said):
        Drive("actuated").wish(*wish)


def test_a_wish_needs_somebody_and_a_policy_that_there_is():
    with pytest.raises(PlanError, match="who wishes"):
        Drive("fixed").wish("call", "a", by=" ")
    with pytest.raises(PlanError, match="did you mean 'actuated'"):
        Drive("fixed").wish("policy", policy="actuatd")


def ask(group, role, eta_ns=None):
    return PriorityCall((7, 1), group, eta_ns, role, 10**18)


def test_an_emergency_vehicle_gets_its_green_out_of_order_and_a_bus_sooner():
    def wait_for(role):
        drive = Drive("priority")
        drive.waits = {"a", "b"}
        drive.run(300)
        while drive.last["a"].colour != "green" or drive.last["a"].since_ns < drive.now_ns - 2 * S:
            drive.run(1)
        drive.waits, asked_ns = {"a", "b", "c"}, drive.now_ns
        drive.priority = (ask("c", role),) if role else ()
        seen = []
        while drive.last["c"].colour != "green":
            drive.run(1)
            seen.append(drive.controller.priority.get((7, 1)))
        drive.run(1)
        seen.append(drive.controller.priority.get((7, 1)))
        return (drive.now_ns - asked_ns) / NS_PER_S, seen

    (nobody, _), (bus, told), (ambulance, _) = map(wait_for, (None, "transit", "emergency"))
    assert ambulance < bus < nobody
    assert (told[0], told[-1]) == ("processing", "granted")


def test_a_request_from_nowhere_or_of_anybody_is_rejected():
    drive = Drive("priority")
    drive.priority = (ask("", "emergency"),)
    drive.run(100)
    assert drive.controller.priority == {(7, 1): "rejected"}
    drive.priority = (ask("a", "basicVehicle"),)
    drive.run(1)
    assert drive.controller.priority == {(7, 1): "rejected"}
    drive.priority = (ask("a", "transit", eta_ns=drive.now_ns + 100 * NS_PER_S),)
    drive.run(1)
    assert drive.controller.priority == {(7, 1): "requested"}


@pytest.mark.parametrize(
    ("learned", "said"),
    [
        (lambda seen: 1 / 0, "ZeroDivisionError"),
        (lambda seen: ["nobody"], "nobody"),
        (lambda seen: ["a", "b"], "conflict"),
        (lambda seen: None, "expected names of groups"),
        (lambda seen: [], "got no green for 180 s"),
        (None, "--learned module:function"),
    ],
)
def test_a_learned_policy_that_fails_falls_back_to_fixed_time(learned, said):
    drive = Drive("learned", learned=learned)
    drive.waits = {"a"}
    spats = drive.run(2500)
    assert said in drive.controller.failure
    assert spats[-1].mode == "plan"


def test_a_learned_policy_decides():
    drive = Drive("learned", learned=lambda seen: [seen.site.program.groups[1]])
    spats = drive.run(300)
    assert drive.controller.failure == ""
    assert {g.colour for g in spats[-1].groups if g.group == "b"} == {"green"}
