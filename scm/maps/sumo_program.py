"""SUMO's signal programs as stages of our junctions: which groups are green together, how long.

    a phase         a stage of all lanes that show green on each of their ways
    no light        lanes that SUMO lets go without one are green in every stage that is free of
                    what they meet
    yellow, all red are left to the kernel, which takes what our cars need, and keeps those green
                    meanwhile who are so before and after; red and yellow (`u`) is red
    turn on red     (`s`) is red: a car may always wait
    same greens     in phases that follow one another are one stage

Whether a stage is safe is checked by `scm.traffic.signals.custom_plans`, with the kernel's rules.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence

import msgspec

from scm.errors import MapError
from scm.maps.conflicts import conflicting_groups
from scm.maps.route import Roads
from scm.maps.sumo_read import OFF, NetPhase
from scm.maps.sumo_ruled import Ruled
from scm.records.city_map import CityMap, PlanStage

GREEN = frozenset("Gg")
YELLOW = frozenset("yY")


def with_programs(
    city_map: CityMap, ruled: Iterable[Ruled], programs: Mapping[str, Sequence[NetPhase]]
) -> tuple[CityMap, dict[str, str]]:
    """Return the city with the network's stages at its junctions, and why some have none.

    Args:
        city_map: The city.
        ruled: What its junctions are in the network.
        programs: By traffic light.
    """
    roads, by_name = Roads(city_map), {junction.name: junction for junction in ruled}
    junctions, why_not = [], {}
    for junction in city_map.junctions:
        conflicts = conflicting_groups(junction, roads)
        try:
            stages = _stages(by_name[junction.name], programs, conflicts)
            junctions.append(msgspec.structs.replace(junction, stages=stages))
        except MapError as refusal:
            why_not[junction.name] = str(refusal)
            junctions.append(junction)
    return msgspec.structs.replace(city_map, junctions=tuple(junctions)), why_not


def _stages(
    junction: Ruled,
    programs: Mapping[str, Sequence[NetPhase]],
    conflicts: Collection[frozenset[str]],
) -> tuple[PlanStage, ...]:
    if len(junction.signals) > 1:
        named = ", ".join(map(repr, junction.signals))
        raise MapError(f"the network has several lights for it, {named}, expected one program")
    numbers = {lane: junction.numbers(lane) for lane in junction.approaches}
    free = [lane for lane, places in numbers.items() if not places]
    held = {lane: places for lane, places in numbers.items() if places}
    stages = stages_of(programs.get(junction.signals[0], ()), held)
    return tuple(_joined(stage, free, conflicts) for stage in stages)


def _joined(
    stage: PlanStage, free: Iterable[str], conflicts: Collection[frozenset[str]]
) -> PlanStage:
    """Return a stage with those that have no light in the network, as far as they may go in it."""
    groups = stage.groups
    for lane in free:
        if not any(frozenset((lane, other)) in conflicts for other in groups):
            groups = (*groups, lane)
    return PlanStage(groups=groups, green_s=stage.green_s)


def stages_of(
    phases: Sequence[NetPhase], numbers: Mapping[str, Sequence[int]]
) -> tuple[PlanStage, ...]:
    """Return a program's stages.

    Args:
        phases: In their order.
        numbers: By lane, the places of its ways in a phase's state.

    Raises:
        MapError: some phase cannot be shown by one light a lane, or there is none.
    """
    stages: list[PlanStage] = []
    for number, phase in enumerate(phases):
        if phase.following not in {(), ((number + 1) % len(phases),)}:
            raise MapError(f"phase {phase.state!r} is not followed by the one after it")
        groups = tuple(lane for lane in numbers if _is_green(phase, lane, numbers[lane]))
        if stages and YELLOW & set(phase.state) and set(groups) <= set(stages[-1].groups):
            continue
        if stages and stages[-1].groups == groups:
            both_s = stages[-1].green_s + phase.duration_s
            stages[-1] = PlanStage(groups=groups, green_s=both_s)
        else:
            stages.append(PlanStage(groups=groups, green_s=phase.duration_s))
    if len(stages) > 1 and stages[0].groups == stages[-1].groups:
        both_s = stages[0].green_s + stages.pop().green_s
        stages[0] = PlanStage(groups=stages[0].groups, green_s=both_s)
    found = tuple(stage for stage in stages if stage.groups)
    if not found:
        raise MapError("the network gives no phase that shows green")
    return found


def _is_green(phase: NetPhase, lane: str, numbers: Sequence[int]) -> bool:
    shown = [phase.state[number] for number in numbers]
    if any(light in OFF for light in shown):
        raise MapError(f"phase {phase.state!r} blinks for lane {lane!r}, expected red or green")
    if any(light in YELLOW for light in shown):
        return False
    greens = [light in GREEN for light in shown]
    if any(greens) and not all(greens):
        raise MapError(
            f"phase {phase.state!r} shows green for some ways of lane {lane!r} alone, expected "
            f"the same for all: a lane has one light here"
        )
    return all(greens)
