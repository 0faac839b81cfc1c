"""Plans that people made: refused with every reason, or run without a broken promise."""

import random

import msgspec
import pytest

from scm.errors import PlanError
from scm.maps.load import load_map
from scm.records.signal_plans import SignalStage
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.store.records import PlanRecord
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.custom_plans import (
    prove_file,
    stages_of,
    table_of,
    wave_of,
)
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.plan import load_timetable
from scm.traffic.signals.program import STEP_NS
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.signal_request import SignalRequest
from scm.v2x.messages.signal_site import SignalSite
from scm.v2x.messages.signal_status import SignalStatus
from scm.v2x.messages.spat import Spat
from scm.v2x.plan_file import PlanFile, fits

S = STEP_NS
MAP = load_map("driving_school")
PROGRAM = Program(
    ("a", "b", "c"),
    (GroupTimes(29 * S, 6 * S, 46 * S), GroupTimes(20 * S, 6 * S, 30 * S), GroupTimes(3 * S, S, S)),
    frozenset({frozenset("ab"), frozenset("bc"), frozenset("ac")}),
)
RUSH = (
    SignalStage(groups=("south_east",), green_s=6.0, extra_red_s=0.5),
    SignalStage(groups=("south_west",), green_s=3.0),
)


def stage(*groups, green_s=5.0, extra_red_s=0.0):
    return SignalStage(groups=groups, green_s=green_s, extra_red_s=extra_red_s)


@pytest.mark.parametrize(
    ("stages", "said"),
    [
        ((stage("a", "b"), stage("c")), "'a' and 'b' conflict but share a stage"),
        ((stage("a"), stage("b")), "group 'c' is never green"),
        ((stage("a", green_s=1.0), stage("b"), stage("c")), "expected at least 2.9 s"),
        ((stage("a", green_s=float("nan")),), "green_s: got nan, expected 0 to 300 s"),
        ((stage("a", extra_red_s=-1.0),), "stage 1: extra_red_s: got -1"),
        ((stage("a"), stage("b", green_s=299.0), stage("c")), "expected 300 s at most"),
        (tuple(stage("a") for _ in range(25)), "stages: got 25, expected 24 at most"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_with_the_reason(stages, said):
    with pytest.raises(PlanError) as refusal:
        table_of("rush", stages, PROGRAM)
    assert said in str(refusal.value)


@pytest.mark.parametrize("offset_s", [-0.1, 60.0, float("nan")])
def test_an_offset_outside_the_cycle_is_refused(offset_s):
    table = table_of("rush", (stage("a"), stage("b"), stage("c")), PROGRAM)
    with pytest.raises(PlanError, match=r"offset_s: got .* less than the cycle of"):
        wave_of(table, offset_s)


@pytest.mark.parametrize("name", ["brisk", "calm"])
def test_the_stages_of_a_timetable_make_it_again(name):
    table = load_timetable(name, PROGRAM)
    assert table_of(name, stages_of(table, PROGRAM), PROGRAM) == table


@pytest.mark.parametrize("seed", range(2))
def test_no_promise_is_broken_while_plans_of_people_come_and_go(seed):
    dice = random.Random(seed)
    controller = Controller("x", PROGRAM, "calm")
    last, kept, ran = {}, 0, set()
    for now_ns in range(0, 12_000 * S, S):
        controller.step(now_ns)
        spat = controller.spat(now_ns)
        ran.add(spat.plan)
        for group in spat.groups:
            before = last.get(group.group)
            if before is not None and before.colour == group.colour:
                assert group.min_end_ns >= before.min_end_ns
                assert group.max_end_ns <= before.max_end_ns
            elif before is not None:
                assert before.min_end_ns <= now_ns <= before.max_end_ns
                kept += 1
            last[group.group] = group
        if dice.random() < 0.004:
            greens = [dice.randrange(30, 200) / 10 for _ in range(3)]
            groups = dice.sample("abc", 3)
            made = tuple(stage(g, green_s=s) for g, s in zip(groups, greens, strict=True))
            table = table_of(dice.choice(["rush", "night"]), made, PROGRAM)
            offset_s = dice.choice([None, dice.randrange(200) / 10])
            controller.request_custom_plan(table, wave_of(table, offset_s))
        elif dice.random() < 0.002:
            controller.request_plan(dice.choice(["calm", "brisk"]))
    assert kept > 100
    assert ran == {"calm", "brisk", "rush", "night"}


def test_a_plan_that_nobody_wants_any_more_is_forgotten():
    controller = Controller("x", PROGRAM, "brisk")
    made = (stage("a"), stage("b"), stage("c"))
    controller.step(0)
    controller.request_custom_plan(table_of("rush", made, PROGRAM))
    steps = iter(range(S, 10_000 * S, S))
    for now_ns in steps:
        controller.step(now_ns)
        if controller.plan == "rush":
            break
    assert controller.pending == ""
    controller.request_plan("brisk")
    for _ in range(1000):
        controller.step(next(steps))
    with pytest.raises(PlanError, match="no plan 'rush'"):
        controller.request_plan("rush")


@pytest.fixture
def city():
    with Lockstep([TrafficPart(MAP, "brisk")]) as running:
        yield running


def ask(city, plan, stages=(), **more):
    who = {"by": "ada", "reason": "school"}
    return city.call(PlanRequest(junction="crossing", plan=plan, stages=stages, **who, **more))


def messages(box):
    return [item.message for item in box.drain()]


def test_a_plan_of_the_bus_is_run_told_and_comes_back_after_a_restart(city):
    spats, events = city.subscribe(Subscription(Spat)), city.subscribe(Subscription(CityEvent))
    city.run_for(6.0)
    assert ask(city, "rush", RUSH) == PlanReply(junction="crossing", plan="brisk", pending="rush")
    city.run_for(40.0)
    assert messages(spats)[-1].plan == "rush"
    said = [event.text for event in messages(events)]
    assert any("takes plan rush (ada asked: school)" in text for text in said)
    assert any("runs plan rush, before brisk" in text for text in said)
    kept = PlanRecord(plan="rush", by="ada", stages=RUSH)
    with Lockstep([TrafficPart(MAP, "brisk", restored={"crossing": kept})]) as again:
        spats = again.subscribe(Subscription(Spat))
        again.run_for(8.0)
        assert messages(spats)[-1].plan == "rush"


def test_the_status_tells_the_plan_that_runs_whatever_comes_after_it(city):
    told = city.subscribe(Subscription(SignalStatus))
    longer = (msgspec.structs.replace(RUSH[0], green_s=9.0), *RUSH[1:])
    city.run_for(6.0)
    assert messages(told)[-1].stages == ()
    ask(city, "rush", RUSH, offset_s=7.3)
    city.run_for(60.0)
    runs = messages(told)[-1]
    assert (runs.plan, runs.stages, runs.offset_s) == ("rush", RUSH, 7.3)
    ask(city, "rush", longer)
    city.run_for(80.0)
    runs = messages(told)[-1]
    assert (runs.pending, runs.stages, runs.offset_s) == ("", longer, None)


def test_a_plan_with_an_offset_begins_its_cycles_in_step_with_the_clock_also_after_a_restart(city):
    city.run_for(6.0)
    cycle_s, offset_s = 20.5, 7.3
    assert ask(city, "rush", RUSH, offset_s=offset_s).pending == "rush"
    kept = PlanRecord(plan="rush", by="ada", stages=RUSH, offset_s=offset_s)
    with Lockstep([TrafficPart(MAP, "brisk", restored={"crossing": kept})]) as again:
        for running in (city, again):
            told = running.subscribe(Subscription(SignalStatus))
            running.run_for(100.0)
            greens = [turn for one in messages(told)[-20:] for turn in one.turns]
            starts_s = {t.start_ns / 1e9 for t in greens if t.groups == ("south_east",)}
            late_s = [(start_s - offset_s) % cycle_s for start_s in starts_s]
            assert len(starts_s) >= 2
            assert max(late_s) == pytest.approx(min(late_s))
            assert max(late_s) < 1.0
    assert isinstance(ask(city, "rush", RUSH, offset_s=cycle_s), Refused)


@pytest.mark.parametrize(("plan", "stages"), [("calm", RUSH), ("flash", RUSH), ("priority", RUSH)])
def test_a_name_that_means_something_else_is_not_taken(city, plan, stages):
    city.run_for(1.0)
    if plan == "flash":
        assert (
            ask(city, plan, stages).plan == "flash"
        )  # flash has no stages: they are not looked at
        return
    refusal = ask(city, plan, stages)
    assert isinstance(refusal, Refused)
    assert (refusal.code, "has one of that name" in refusal.detail) == ("invalid", True)


def test_what_a_junction_is_and_what_is_wished_of_it_is_told(city):
    sites, told = (
        city.subscribe(Subscription(SignalSite)),
        city.subscribe(Subscription(SignalStatus)),
    )
    city.run_for(21.0)
    site = messages(sites)[-1]
    assert [phase.group for phase in site.phases] == ["south_east", "south_west"]
    assert site.rings == ((("south_east", "south_west"),),)
    assert {plan.plan for plan in site.plans} == {"brisk", "calm"}
    assert len(messages(told)) == pytest.approx(22, abs=2)
    city.call(SignalRequest(junction="crossing", verb="hold", groups=("south_east",), by="ada"))
    city.run_for(0.2)
    wishes = messages(told)[-1].wishes
    assert [(wish.verb, wish.by) for wish in wishes] == [("hold", "ada")]
    clear = {"verb": "clear", "groups": ("south_east",), "by": "ada"}
    city.call(SignalRequest(junction="crossing", clears="call", **clear))
    city.run_for(0.2)
    assert len(messages(told)) in (0, 1)
    reply = city.call(SignalRequest(junction="crossing", clears="hold", **clear))
    assert reply.wishes == ()


def test_greens_to_come_are_told_as_they_come(city):
    told, spats = city.subscribe(Subscription(SignalStatus)), city.subscribe(Subscription(Spat))
    city.run_for(12.0)
    turn = next(t for t in messages(told)[-1].turns if t.start_ns > city.now_ns)
    city.run_for((turn.start_ns - city.now_ns) / 1e9 + 0.25)
    green = {group.group for group in messages(spats)[-1].groups if group.colour == "green"}
    assert green == set(turn.groups)


def test_a_file_is_proven_for_the_junction_that_it_describes(city):
    sites = city.subscribe(Subscription(SignalSite))
    city.run_for(1.0)
    site = messages(sites)[0]
    facts = {"junction": "crossing", "phases": site.phases, "conflicts": site.conflicts}
    file = PlanFile(plan="rush", stages=RUSH, **facts)
    proof = prove_file(file)
    assert proof.digest == file.digest
    assert proof.cycle_s == pytest.approx(6.0 + 3.0 + 0.5 + 2 * (0.6 + 4.6 + 0.3))
    assert fits(file, site)
    other = PlanFile(plan="rush", stages=(RUSH[1], RUSH[0]), **facts)
    assert other.digest != file.digest
