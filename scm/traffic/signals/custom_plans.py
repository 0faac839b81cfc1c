"""Custom plans: stages of a request or of the map, checked, and as a timetable.

A plan that comes with a request stays as long as the junction runs it or is about to. A map can
give a junction stages of its own, for instance those of SUMO's network: they become the plan `own`,
and an importer calls `adopted` first, which leaves out what the kernel's rules do not allow. The
kernel stays safe whatever a plan requests; a refused one would not do what its maker meant.
"""

import math
import time
from collections.abc import Collection, Iterable, Sequence

from msgspec.structs import replace

from scm.errors import PlanError
from scm.maps.route import Roads
from scm.records.city_map import CityMap, Junction, PlanStage
from scm.records.signal_plans import PlanProof, SignalPhase, SignalStage
from scm.traffic.signals import kernel
from scm.traffic.signals.green_wave import Wave
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.plan import (
    FLASH,
    Stage,
    TimedStage,
    Timetable,
    green_ns,
    least_between_ns,
    timetable,
)
from scm.traffic.signals.program import program_of, whole_steps_ns
from scm.traffic.signals.proof.load_checks import check_junction, check_table
from scm.traffic.signals.proof.plan_proof import prove_plan
from scm.traffic.signals.timing import NIGEL, CarFacts
from scm.v2x.plan_file import PlanFile

OWN = "own"  # the plan of the stages that a map gives a junction
MAX_CYCLE_S = 300.0  # nobody waits for longer than five minutes
MAX_STAGES = 24  # the time of a proof grows with them


def table_of(plan: str, stages: Sequence[SignalStage], program: Program) -> Timetable:
    """Return the timetable of a plan that somebody made, and that serves everybody.

    Args:
        plan: Its name.
        stages: In the order of the cycle.
        program: Of the junction.

    Raises:
        PlanError: naming every problem of the stages at once.
    """
    table = limited_table(plan, stages, program)
    check_table(table, program)
    return table


def limited_table(plan: str, stages: Sequence[SignalStage], program: Program) -> Timetable:
    """Return the timetable of a plan that is within the limits; see `table_of`."""
    problems = _problems(stages)
    if problems:
        raise PlanError(f"plan {plan!r}: " + "; ".join(problems))
    cycle = tuple(
        Stage(stage.groups, whole_steps_ns(stage.green_s), whole_steps_ns(stage.extra_red_s))
        for stage in stages
    )
    table = timetable(plan, cycle, program)
    if table.length_ns > MAX_CYCLE_S * 1e9:
        got_s = table.length_ns / 1e9
        msg = f"plan {plan!r}: cycle: got {got_s:g} s, expected {MAX_CYCLE_S:g} s at most"
        raise PlanError(msg)
    return table


def wave_of(table: Timetable, offset_s: float | None) -> Wave | None:
    """Return the place of a plan's cycle in time; None: it has none.

    Raises:
        PlanError: when it is not inside the cycle.
    """
    if offset_s is None:
        return None
    if not 0.0 <= offset_s < table.length_ns / 1e9:
        expected = f"expected 0 to less than the cycle of {table.length_ns / 1e9:g} s"
        raise PlanError(f"plan {table.plan!r}: offset_s: got {offset_s:g} s, {expected}")
    return Wave(table.length_ns, round(offset_s * 1e9))


def check_plan_name(plan: str, in_use: Collection[str]) -> None:
    """Refuse a name that means something else.

    Raises:
        PlanError: naming it.
    """
    if plan == FLASH or plan in in_use:
        msg = f"plan {plan!r}: the junction has one of that name, expected another"
        raise PlanError(msg)


def stages_of(table: Timetable, program: Program) -> tuple[SignalStage, ...]:
    """Return the stages that make a timetable."""
    following = [*table.timed_stages[1:], TimedStage(frozenset(), table.length_ns, table.length_ns)]
    made = []
    for timed, after in zip(table.timed_stages, following, strict=True):
        groups = tuple(name for name in program.groups if name in timed.groups)
        between_ns = least_between_ns(timed.groups, after.groups, program)
        extra_ns = after.start_ns - timed.end_ns - between_ns
        made.append(
            SignalStage(
                groups=groups,
                green_s=(timed.end_ns - timed.start_ns) / 1e9,
                extra_red_s=extra_ns / 1e9,
            )
        )
    return tuple(made)


def map_timetable(
    stages: Sequence[PlanStage], program: Program, *, longer: bool = False
) -> Timetable:
    """Return the timetable of a junction's own stages.

    Args:
        stages: Of the map.
        program: Of the junction.
        longer: Greens become no shorter than a minimum green, instead of being refused.

    Raises:
        PlanError: naming every problem of the stages at once.
    """
    made = [SignalStage(groups=stage.groups, green_s=stage.green_s) for stage in stages]
    return retimed(OWN, made, program) if longer else limited_table(OWN, made, program)


def retimed(plan: str, stages: Iterable[SignalStage], program: Program) -> Timetable:
    """Return the timetable of a plan for other least times; greens become no shorter than those.

    Raises:
        PlanError: when a group is not green in every cycle.
    """
    cycle = tuple(
        Stage(
            one.groups,
            max(whole_steps_ns(one.green_s), green_ns(program, one.groups)),
            whole_steps_ns(one.extra_red_s),
        )
        for one in stages
    )
    table = timetable(plan, cycle, program)
    check_table(table, program)
    return table


def adopted(city_map: CityMap, car: CarFacts = NIGEL) -> tuple[CityMap, dict[str, str]]:
    """Return a city whose junctions run their own stages where that is safe, and why some do not.

    Args:
        city_map: Whose junctions have stages, and another plan to fall back to.
        car: As bad as the worst of those that drive here.
    """
    roads = Roads(city_map)
    junctions, why_not = [], {}
    for junction in city_map.junctions:
        try:
            junctions.append(_adopted(junction, roads, car))
        except PlanError as refusal:
            why_not[junction.name] = str(refusal)
            junctions.append(replace(junction, stages=()))
    return replace(city_map, junctions=tuple(junctions)), why_not


def _adopted(junction: Junction, roads: Roads, car: CarFacts) -> Junction:
    if not junction.stages:
        return junction
    program = program_of(junction, roads, car)
    check_junction(junction.name, program, [map_timetable(junction.stages, program)])
    return replace(junction, plan=OWN)


def prove_file(file: PlanFile) -> PlanProof:
    """Prove a plan for the junction that its file describes.

    Raises:
        PlanError: saying what is not as it must be.
    """
    began_s = time.perf_counter()
    program = _program(file.phases, file.conflicts)
    table = table_of(file.plan, file.stages, program)
    found = prove_plan(kernel, program, table)
    return PlanProof(
        digest=file.digest,
        states=found.states,
        transitions=found.transitions,
        plan_states=found.plan_states,
        plan_transitions=found.plan_transitions,
        cycle_s=table.length_ns / 1e9,
        took_s=round(time.perf_counter() - began_s, 3),
    )


def _program(phases: Sequence[SignalPhase], conflicts: Collection[tuple[str, str]]) -> Program:
    return Program(
        groups=tuple(phase.group for phase in phases),
        times=tuple(
            GroupTimes(
                whole_steps_ns(phase.min_green_s),
                whole_steps_ns(phase.yellow_s),
                whole_steps_ns(phase.red_clear_s),
            )
            for phase in phases
        ),
        conflicts=frozenset(frozenset(pair) for pair in conflicts),
    )


def _problems(stages: Sequence[SignalStage]) -> list[str]:
    problems = []
    if len(stages) > MAX_STAGES:
        problems.append(f"stages: got {len(stages)}, expected {MAX_STAGES} at most")
    for number, stage in enumerate(stages, 1):
        for field, value in (("green_s", stage.green_s), ("extra_red_s", stage.extra_red_s)):
            if not (math.isfinite(value) and 0.0 <= value <= MAX_CYCLE_S):
                expected = f"expected 0 to {MAX_CYCLE_S:g} s"
                problems.append(f"stage {number}: {field}: got {value:g}, {expected}")
    return problems
