"""A junction's own plan: the stages that its map gives it, for instance those of SUMO's network.

It is the plan `own`, with the times and the order of the map and the yellow and all-red of our
kernel, within the limits of plans that people make. An importer calls `adopted` first: it leaves
out what the rules of the kernel do not allow.
"""

from collections.abc import Sequence

import msgspec

from scm.errors import PlanError
from scm.maps.route import Roads
from scm.records.city_map import CityMap, Junction, PlanStage
from scm.records.signal_plans import SignalStage
from scm.traffic.signals.custom_plans import limited_table
from scm.traffic.signals.kernel import Program
from scm.traffic.signals.plan import Timetable
from scm.traffic.signals.program import program_of
from scm.traffic.signals.proof.load_checks import check_junction
from scm.traffic.signals.timing import NIGEL, CarFacts

OWN = "own"


def map_timetable(stages: Sequence[PlanStage], program: Program) -> Timetable:
    """Return the timetable of a junction's own stages.

    Raises:
        PlanError: naming every problem of the stages at once.
    """
    made = [SignalStage(groups=stage.groups, green_s=stage.green_s) for stage in stages]
    return limited_table(OWN, made, program)


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
            junctions.append(msgspec.structs.replace(junction, stages=()))
    return msgspec.structs.replace(city_map, junctions=tuple(junctions)), why_not


def _adopted(junction: Junction, roads: Roads, car: CarFacts) -> Junction:
    if not junction.stages:
        return junction
    program = program_of(junction, roads, car)
    check_junction(junction.name, program, [map_timetable(junction.stages, program)])
    return msgspec.structs.replace(junction, plan=OWN)
