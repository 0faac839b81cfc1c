"""From a map to the program of a junction's kernel: its groups, least times and conflicts."""

import math

from scm.clock import NS_PER_MS
from scm.errors import PlanError
from scm.maps.conflicts import conflicting_groups
from scm.maps.route import Roads
from scm.records.city_map import Conflict, Group, Junction, StopLine
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.timing import NIGEL, CarFacts, clearance_s, min_green_s, yellow_s

STEP_NS = 100 * NS_PER_MS


def whole_steps_ns(time_s: float) -> int:
    """Return a time rounded up to whole steps of the signals [ns]."""
    return math.ceil(time_s * 10.0 - 1e-9) * STEP_NS


def program_of(junction: Junction, roads: Roads, car: CarFacts = NIGEL) -> Program:
    """Return what the kernel of a junction must keep.

    Raises:
        PlanError: when a group has no stop line, or its movement does not follow it.
    """
    return Program(
        groups=tuple(group.name for group in junction.groups),
        times=tuple(_times(junction, group, roads, car) for group in junction.groups),
        conflicts=conflicting_groups(junction, roads),
    )


def _times(junction: Junction, group: Group, roads: Roads, car: CarFacts) -> GroupTimes:
    lines = roads.stop_lines_of(junction.name, group.name)
    if not lines:
        msg = f"junction {junction.name}: group {group.name!r} has no stop line on map"
        raise PlanError(f"{msg} {roads.city_map.name}")
    lanes = [line.lane for line in lines] + [move.lane for move in group.movements]
    limits_mps = [roads.definition(lane).speed_limit_mps for lane in lanes]
    limit_mps, fastest_mps = min(limits_mps), max(limits_mps)
    way_m = max(_way_m(line, move, group, roads) for line in lines for move in group.movements)
    return GroupTimes(
        min_green=whole_steps_ns(min_green_s(car, limit_mps)),
        yellow=whole_steps_ns(yellow_s(car, fastest_mps)),
        clearance=whole_steps_ns(clearance_s(car, way_m, limit_mps)),
    )


def _way_m(line: StopLine, movement: Conflict, group: Group, roads: Roads) -> float:
    """Return the way from a stop line to the end of a movement of its group [m]."""
    if movement.lane == line.lane:
        return movement.to_m - line.at_m
    if movement.lane in roads.successors(line.lane):
        return roads.length_of(line.lane) - line.at_m + movement.to_m
    msg = f"stop line {line.name!r}: lane {line.lane!r} does not lead to {movement.lane!r}, the"
    raise PlanError(f"{msg} movement of group {group.name!r} on map {roads.city_map.name}")
