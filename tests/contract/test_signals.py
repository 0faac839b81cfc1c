"""Every signalled junction of every shipped map, under every shipped plan, is safe and honest."""

import ast
import random
from itertools import pairwise
from pathlib import Path

import pytest

import scm.traffic.monitor
from scm.maps.load import load_map, map_names
from scm.maps.route import Roads
from scm.registry import load
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.monitor.checks import Monitor
from scm.traffic.monitor.conflict_table import conflict_table_of
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals import kernel
from scm.traffic.signals.controller import Controller
from scm.traffic.signals.part import TrafficPart
from scm.traffic.signals.plan import PACKAGE, Plan, load_timetable, plan_names
from scm.traffic.signals.program import STEP_NS, program_of
from scm.traffic.signals.proof.kernel_proof import in_steps, prove
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx

MAPS = [city_map for city_map in map(load_map, map_names()) if city_map.junctions]
CASES = [
    pytest.param(city_map, junction, id=f"{city_map.name}-{junction.name}")
    for city_map in MAPS
    for junction in city_map.junctions
]
BY_MAP = pytest.mark.parametrize("city_map", MAPS, ids=lambda city_map: city_map.name)


def messages(box):
    return [item.message for item in box.drain()]


@pytest.mark.parametrize(("city_map", "junction"), CASES)
def test_the_kernel_is_proven_for_the_junction_at_its_real_times(city_map, junction):
    program = in_steps(program_of(junction, Roads(city_map)), STEP_NS)
    assert prove(kernel, program).transitions > len(program.groups)


@pytest.mark.parametrize(("city_map", "junction"), CASES)
def test_both_channels_find_the_same_conflicts_by_different_code(city_map, junction):
    program = program_of(junction, Roads(city_map))
    card = conflict_table_of(city_map, junction)
    assert {frozenset(pair) for pair in card.conflicts} == program.conflicts


@pytest.mark.parametrize(("city_map", "junction"), CASES)
@pytest.mark.parametrize("plan", plan_names())
def test_a_plan_fits_the_junction_and_serves_every_group(city_map, junction, plan):
    program = program_of(junction, Roads(city_map))
    table = load_timetable(plan, program)
    assert set().union(*(slot.groups for slot in table.timed_stages)) == set(program.groups)
    assert load(PACKAGE, plan, "PLAN", Plan).about


@BY_MAP
@pytest.mark.parametrize("plan", plan_names())
def test_the_monitor_agrees_with_the_controller_for_five_minutes(city_map, plan):
    with Lockstep([TrafficPart(city_map, plan), MonitorPart(city_map)]) as city:
        spats, statuses = (
            city.subscribe(Subscription(Spat)),
            city.subscribe(Subscription(MonitorStatus)),
        )
        city.run_for(300.0)
    assert {status.fault for status in messages(statuses)} == {None}
    shown = {(g.group, g.colour) for spat in messages(spats) for g in spat.groups}
    groups = {group.name for junction in city_map.junctions for group in junction.groups}
    assert {name for name, colour in shown if colour == "green"} == groups


@BY_MAP
def test_spat_keeps_its_promises_on_the_bus_while_plans_change(city_map):
    dice = random.Random(4)
    with Lockstep([TrafficPart(city_map)]) as city:
        spats, spatems = city.subscribe(Subscription(Spat)), city.subscribe(Subscription(SpatemTx))
        for _ in range(30):
            city.run_for(dice.uniform(1.0, 40.0))
            junction, plan = dice.choice(city_map.junctions).name, dice.choice(plan_names())
            city.call(PlanRequest(junction=junction, plan=plan, by="test"))
        for junction in city_map.junctions:
            mine = [s for s in messages(spats) if s.junction == junction.name]
            keeps_promises([{g.group: g for g in s.groups} for s in mine], [s.t_ns for s in mine])
        bodies = [spatem.body for spatem in messages(spatems)]
    assert all(state.min_end_time != 36001 for body in bodies for state in body.states)


def keeps_promises(samples, times_ns):
    for (before, now), now_ns in zip(pairwise(samples), times_ns[1:], strict=True):
        for name, group in now.items():
            if group.colour == before[name].colour:
                assert group.min_end_ns >= before[name].min_end_ns
                assert group.max_end_ns <= before[name].max_end_ns
            else:
                assert group.colour == before[name].next_colour
                assert before[name].min_end_ns <= now_ns <= before[name].max_end_ns


def wrong(program, **times):
    changed = tuple(group._replace(**times) for group in program.times)
    return program._replace(times=changed)


WRONG = {
    "short_yellow": lambda program: wrong(program, yellow=3 * STEP_NS),
    "short_clearance": lambda program: wrong(program, clearance=20 * STEP_NS),
    "short_green": lambda program: wrong(program, min_green=10 * STEP_NS),
    "conflict": lambda program: program._replace(conflicts=frozenset()),
}


@pytest.mark.parametrize(("city_map", "junction"), CASES)
@pytest.mark.parametrize("fault", WRONG)
def test_a_controller_with_a_wrong_program_is_caught_in_its_first_cycle(city_map, junction, fault):
    program = WRONG[fault](program_of(junction, Roads(city_map)))
    controller = Controller(junction.name, program, "brisk")
    monitor = Monitor(conflict_table_of(city_map, junction), 0)
    for k in range(load_timetable("brisk", program).length_ns // STEP_NS + 100):
        controller.step(k * STEP_NS)
        monitor.see(controller.spat(k * STEP_NS), k * STEP_NS)
        monitor.tick(k * STEP_NS)
    assert monitor.fault == fault


def test_the_second_channel_imports_nothing_of_the_first():
    for place in Path(scm.traffic.monitor.__file__).parent.glob("*.py"):
        tree = ast.parse(place.read_text(encoding="utf-8"))
        imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        own = [module for module in imported if module.startswith("scm.traffic")]
        assert all(module.startswith("scm.traffic.monitor.") for module in own)
        assert "scm.maps.conflicts" not in imported
