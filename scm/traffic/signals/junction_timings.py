"""From a map and the worst of its cars to the least times and timetables of all junctions."""

from scm.maps.once_per_map import once_per_map
from scm.maps.route import Roads, roads_of
from scm.records.city_map import CityMap
from scm.traffic.signals.controller_state import Timing
from scm.traffic.signals.custom_plans import OWN, map_timetable
from scm.traffic.signals.green_wave import links_of, waves_of
from scm.traffic.signals.kernel import Program
from scm.traffic.signals.plan import load_timetable, plan_names
from scm.traffic.signals.program import program_of
from scm.traffic.signals.proof.load_checks import check_junction
from scm.traffic.signals.timetables import Tables
from scm.traffic.signals.timing import CarFacts
from scm.v2x.etsi.mapem import MapemBody
from scm.v2x.etsi.topology import mapem_of


@once_per_map
def timings_of(city_map: CityMap, car: CarFacts) -> dict[str, Timing]:
    """Return the times of each junction: checked once, and shared by cities of one map.

    Raises:
        PlanError: when a plan is not safe for a junction.
    """
    timings = timings_for(city_map, car)
    for name, timing in timings.items():
        check_timing(name, timing)
    return timings


@once_per_map
def topologies_of(city_map: CityMap) -> dict[str, MapemBody]:
    """Return what each junction's roadside station sends of its lanes."""
    roads = roads_of(city_map)
    return {junction.name: mapem_of(roads, junction) for junction in city_map.junctions}


def timings_for(city_map: CityMap, car: CarFacts, *, longer: bool = False) -> dict[str, Timing]:
    """Return the times of each junction, which `check_timing` has to check.

    Args:
        city_map: Whose junctions.
        car: As bad as the worst of those that drive here.
        longer: Greens of the map's own stages become no shorter than a minimum green, instead of
            being refused.

    Raises:
        PlanError: when a plan is not safe for a junction.
    """
    roads = roads_of(city_map)
    programs = {j.name: program_of(j, roads, car) for j in city_map.junctions}
    tables = timetables_of(city_map, roads, programs, car, longer=longer)
    return {name: Timing(programs[name], tables[name], car) for name in programs}


def check_timing(junction: str, timing: Timing) -> None:
    """Prove the rings of a junction, and run all policies and plans over its kernel.

    Raises:
        PlanError: naming the junction, and what is wrong.
    """
    check_junction(junction, timing.program, (table for table, _ in timing.tables.values()))


def timetables_of(
    city_map: CityMap,
    roads: Roads,
    programs: dict[str, Program],
    car: CarFacts,
    *,
    longer: bool = False,
) -> dict[str, Tables]:
    """Return the timetables of all plans by junction; of several junctions they make green waves.

    A junction with stages of its own also has the plan `own`, which is not coordinated.

    Raises:
        PlanError: when a plan is not safe for a junction.
    """
    links = links_of(city_map, roads, car) if len(programs) > 1 else []
    tables: dict[str, Tables] = {name: {} for name in programs}
    for plan in plan_names():
        alone = {name: load_timetable(plan, program) for name, program in programs.items()}
        waves = waves_of(links, alone) if links else {n: (t, None) for n, t in alone.items()}
        for name, pair in waves.items():
            tables[name] = {**tables[name], plan: pair}
    for junction in city_map.junctions:
        if junction.stages:
            table = map_timetable(junction.stages, programs[junction.name], longer=longer)
            tables[junction.name] = {**tables[junction.name], OWN: (table, None)}
    return tables
