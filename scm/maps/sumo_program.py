"""SUMO's signal programs as stages of our junctions: which groups are green together, how long.

    a phase         a stage of all lanes that show green on each of their ways
    yellow, all red are left to the kernel, which takes what our cars need, and keeps those green
                    meanwhile who are so before and after
    same greens     in phases that follow one another are one stage

Whether a stage is safe is not asked here: `scm.traffic.own_plan` has the kernel's rules do that.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence

import msgspec

from scm.errors import MapError
from scm.maps.model import CityMap, PlanStage
from scm.maps.sumo_read import Net, NetLink, NetPhase

GREEN = frozenset("Gg")
YELLOW = frozenset("yY")
BLINKS = frozenset("oOsu")


def with_programs(
    city_map: CityMap, net: Net, links: Iterable[NetLink], name_of: Callable[[str], str]
) -> tuple[CityMap, dict[str, str]]:
    """Return the city with the network's stages at its junctions, and why some have none.

    Args:
        city_map: Whose junctions are named by `name_of` the network's signals.
        net: Where it comes from.
        links: The ways that the city has of it.
        name_of: From a signal's id to its junction.
    """
    numbers: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for link in links:
        if link.signal:
            numbers[name_of(link.signal)][link.start].append(link.number)
    programs = {name_of(signal): phases for signal, phases in net.programs.items()}
    junctions, why_not = [], {}
    for junction in city_map.junctions:
        try:
            stages = stages_of(programs.get(junction.name, ()), numbers[junction.name])
            junctions.append(msgspec.structs.replace(junction, stages=stages))
        except MapError as refusal:
            why_not[junction.name] = str(refusal)
            junctions.append(junction)
    return msgspec.structs.replace(city_map, junctions=tuple(junctions)), why_not


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
    for phase in phases:
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
    if any(light in BLINKS for light in shown):
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
