"""Likely ends lie between what is promised, come true under a timetable, and own up to doubt."""

import random
from collections import defaultdict
from functools import cache

import pytest

from scm.clock import NS_PER_S
from scm.traffic.signals import rings
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.controller_state import Observations
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.forecast import CLEARING_CONFIDENCE, forecasts, schedule, within
from scm.traffic.signals.guaranteed_time import GuaranteedTime
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import plan_names
from scm.traffic.signals.policies import actuated
from scm.traffic.signals.policy import Policy, Turn, site_of
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.rings import Layout, PhaseTimes, Ring, Rings
from scm.v2x.messages.signal_request import SignalRequest

S = STEP_NS
TIMES = GroupTimes(29 * S, 6 * S, 46 * S)
PAIRS = frozenset(frozenset(pair) for pair in ("ab", "bc", "ac"))
CROSSING = Program(("a", "b", "c"), (TIMES,) * 3, PAIRS)
HEADWAY_S, SIGHT_S = 2.4, 8.0
ADAPTIVE = ("actuated", "max_pressure", "priority")


class Queues:
    """Cars that come by chance, wait, and leave one by one; seen `SIGHT_S` before the line."""

    def __init__(self, every_s, seed):
        self.dice, self.every_s = random.Random(seed), every_s
        self.coming = {name: [self.later(0.0)] for name in "abc"}
        self.standing = dict.fromkeys("abc", 0)
        self.goes_s = dict.fromkeys("abc", 0.0)

    def later(self, after_s):
        return after_s + max(HEADWAY_S, self.dice.expovariate(1.0 / self.every_s))

    def step(self, now_s, green):
        heard = {}
        for name, coming in self.coming.items():
            while coming[-1] < now_s + SIGHT_S:
                coming.append(self.later(coming[-1]))
            while coming[0] <= now_s:
                coming.pop(0)
                self.standing[name] += not (name in green and not self.standing[name])
            if name not in green:
                self.goes_s[name] = now_s + HEADWAY_S
            elif self.standing[name] and now_s >= self.goes_s[name]:
                self.standing[name] -= 1
                self.goes_s[name] = now_s + HEADWAY_S
            arrivals = tuple(at - now_s for at in coming if at < now_s + SIGHT_S)
            near = self.standing[name] + len(arrivals)
            heard[name] = Detector(
                call=near > 0, near=near, queue=self.standing[name], arrivals_s=arrivals
            )
        return heard


def driven(controller, steps, each=lambda now_ns, green: Observations({}, sees=True)):
    """Yield every SPaT, `each` telling what is heard."""
    green = frozenset()
    for k in range(steps):
        controller.step(k * S, each(k * S, green))
        spat = controller.spat(k * S)
        green = frozenset(g.group for g in spat.groups if g.colour == "green")
        yield spat


def queued(policy, steps, every_s=12.0, seed=0):
    queues = Queues(every_s, seed)
    controller = Controller("x", CROSSING, "calm", policy=policy)
    return driven(
        controller,
        steps,
        lambda t, green: Observations(queues.step(t / NS_PER_S, green), sees=True),
    )


def judged(spats):
    """Return (forecast, when it was made, when the colour ended) of every forecast that ended."""
    made, ended = defaultdict(list), []
    for spat in spats:
        for now in spat.groups:
            before = made[now.group]
            if before and before[-1][0].colour != now.colour:
                ended += [(group, t_ns, spat.t_ns) for group, t_ns in before]
                before.clear()
            before.append((now, spat.t_ns))
    return [one for one in ended if one[0].likely_end_ns is not None]


STEPS_OF = {40.0: 6000, 15.0: 12_000}  # confidences of dense traffic vary from cycle to cycle


@cache
def judged_under(policy, every_s):
    return judged(queued(policy, STEPS_OF[every_s], every_s))


@pytest.mark.parametrize("plan", plan_names())
def test_under_a_timetable_every_colours_likely_end_is_the_true_one(plan):
    spats = list(driven(Controller("x", CROSSING, plan), 2500))
    assert all(group.likely_end_ns is not None for spat in spats for group in spat.groups)
    assert {group.likely_end_ns - end_ns for group, _, end_ns in judged(spats)} == {0}


def test_a_plan_that_is_to_come_is_reckoned_with():
    controller = Controller("x", CROSSING, "brisk")
    list(driven(controller, 100))
    controller.request_plan("calm")
    spats = []
    for k in range(100, 1500):
        controller.step(k * S)
        spats.append(controller.spat(k * S))
    assert {spat.plan for spat in spats} == {"brisk", "calm"}
    late = [one for one in judged(spats) if one[1] >= 106 * S]
    assert {group.likely_end_ns - end_ns for group, _, end_ns in late} == {0}


@pytest.mark.parametrize("policy", [*ADAPTIVE, "fixed"])
def test_a_likely_end_lies_between_the_earliest_and_the_latest(policy):
    dice, known = random.Random(1), 0
    controller = Controller("x", CROSSING, "brisk", policy=policy)
    queues = Queues(9.0, 2)

    def each(now_ns, green):
        if dice.random() < 0.01:
            verb, group = dice.choice(["call", "hold", "omit", "preempt"]), dice.choice("abc")
            wish = SignalRequest(
                junction="x", verb=verb, groups=(group,), by="me", expires_s=dice.uniform(1.0, 9.0)
            )
            controller.overrides = ()
            controller.apply_override(wish, now_ns)
        if dice.random() < 0.003:
            controller.request_plan(dice.choice(["calm", "brisk", policy]))
        return Observations(queues.step(now_ns / NS_PER_S, green), sees=dice.random() < 0.9)

    for spat in driven(controller, 3000, each):
        for group in spat.groups:
            if group.likely_end_ns is None:
                assert group.likely_confidence is None
                continue
            known += 1
            assert group.min_end_ns <= group.likely_end_ns
            assert group.max_end_ns is None or group.likely_end_ns <= group.max_end_ns
            assert spat.t_ns <= group.likely_end_ns or group.max_end_ns is not None
            assert 0.0 < group.likely_confidence <= 1.0
    assert known > 3000


@pytest.mark.parametrize("policy", ["actuated", "max_pressure"])
@pytest.mark.parametrize("every_s", STEPS_OF)
def test_no_more_confidence_is_told_than_comes_true(policy, every_s):
    shares = defaultdict(list)
    for group, _, end_ns in judged_under(policy, every_s):
        hit = abs(group.likely_end_ns - end_ns) <= NS_PER_S
        shares[group.likely_confidence].append(hit)
    assert len(shares) >= 4
    for told, hits in shares.items():
        if len(hits) >= 300:
            assert sum(hits) / len(hits) >= told - 0.05, (told, len(hits))


@pytest.mark.parametrize("policy", ["actuated", "max_pressure"])
def test_a_red_is_foreseen_nearer_to_the_truth_than_its_earliest_end(policy):
    reds = [one for one in judged_under(policy, 15.0) if one[0].colour == "red"]
    likely = sum(abs(group.likely_end_ns - end_ns) for group, _, end_ns in reds)
    earliest = sum(abs(group.min_end_ns - end_ns) for group, _, end_ns in reds)
    assert len(reds) > 1000
    assert likely < 0.6 * earliest


@pytest.mark.parametrize("policy", ADAPTIVE)
def test_a_green_that_nobody_disputes_has_no_likely_end(policy):
    controller = Controller("x", CROSSING, "calm", policy=policy)
    alone = {name: Detector() for name in "bc"} | {"a": Detector(call=True, near=1, queue=1)}
    last = list(driven(controller, 900, lambda *_: Observations(alone, sees=True)))[-1]
    (green,) = (group for group in last.groups if group.colour == "green")
    assert (green.group, green.likely_end_ns, green.max_end_ns) == ("a", None, None)


def test_nobody_foresees_how_long_a_person_holds_a_green():
    controller = Controller("x", CROSSING, "calm", policy="actuated")
    all_of_them = dict.fromkeys("abc", Detector(call=True, near=1, queue=1))

    def each(now_ns, green):
        if green and not controller.overrides:
            wish = SignalRequest(
                junction="x", verb="hold", groups=tuple(green), by="me", expires_s=60.0
            )
            controller.apply_override(wish, now_ns)
        return Observations(all_of_them, sees=True)

    spats = list(driven(controller, 700, each))
    held = [g for s in spats[-20:] for g in s.groups if g.likely_end_ns is None]
    assert len(held) == 60


def test_a_policy_that_fails_to_foresee_is_given_up_for_fixed_time():
    controller = Controller("x", CROSSING, "calm", policy="actuated")
    usual = controller._policies["actuated"]
    broken = Policy(usual.about, usual.start, usual.step, foresee=lambda *_: 1 / 0)
    controller._policies["actuated"] = broken
    spats = list(driven(controller, 1500, lambda *_: Observations({}, sees=True)))
    assert controller.failure == "policy actuated: ZeroDivisionError: division by zero"
    assert spats[-1].plan == "calm"


def test_turns_are_put_one_after_the_other_with_the_kernels_times_between():
    state = tuple(
        group._replace(phase=phase)
        for group, phase in zip(
            Controller("x", CROSSING, "calm")._state,
            (rings.Phase.GREEN, rings.Phase.RED, rings.Phase.RED),
            strict=True,
        )
    )
    turns = [Turn(frozenset("a"), 4.0), Turn(frozenset("b"), 3.0), Turn(frozenset("c"), None)]
    promises = [GuaranteedTime(10 * S, None), GuaranteedTime(0, None), GuaranteedTime(0, None)]
    ends = forecasts(CROSSING, state, schedule(CROSSING, state, promises, turns, 0))
    assert ends == {"a": 40 * S, "b": (40 + 52) * S, "c": (40 + 52 + 30 + 52) * S}


def test_a_forecast_is_bounded_by_the_promise_and_surer_the_nearer_it_is():
    promise = GuaranteedTime(50 * S, 200 * S)

    def told(at, **more):
        return within(promise, at * S, 10 * S, **({"red": True, "planned": False} | more))

    assert told(20) == (50 * S, CLEARING_CONFIDENCE)
    assert told(20, red=False).confidence < CLEARING_CONFIDENCE
    assert told(300).end_ns == 200 * S
    assert told(60).confidence > told(100).confidence
    assert within(promise, None, 0, red=True, planned=False) is None
    assert within(GuaranteedTime(50 * S, 52 * S), None, 0, red=True, planned=False) == (50 * S, 1.0)


def test_phases_are_foreseen_in_the_order_in_which_the_rings_serve_them():
    phase = PhaseTimes(2, 1, 3, 4)
    layout = Layout((phase,) * 5, (((0, 1), (2,)), ((3, 4),)))
    state = Rings(0, (Ring(1), Ring(2)))
    order = rings.order_of(layout, state, frozenset((0, 3, 4)))
    assert order == [{1, 2}, {3}, {4}, {0}]
    assert rings.order_of(layout, state, frozenset((0,))) == [{1, 2}, {0, 2}]
    assert rings.order_of(layout, Rings(0, (Ring(), Ring())), frozenset()) == []


def test_what_is_foreseen_of_a_queue_is_its_turn_and_those_who_wait_behind_it():
    controller = Controller("x", CROSSING, "calm", policy="actuated")
    cars = {"a": Detector(call=True, near=3, queue=3), "b": Detector(call=True, near=1, queue=1)}
    heard = cars | {"c": Detector()}
    list(driven(controller, 60, lambda *_: Observations(heard, sees=True)))
    turns = actuated.foresee(
        site_of("x", CROSSING),
        controller._policy_state.memory,
        controller._view(60 * S, 0, Observations(heard, True)),
    )
    assert [turn.groups for turn in turns] == [{"a"}, {"b"}]
    assert turns[1].green_s == pytest.approx(3.9)
