"""From a map to the program of a junction's kernel: its groups, least times and conflicts."""

import math

from scm.clock import NS_PER_MS
from scm.errors import PlanError
from scm.maps.conflicts import conflicting_groups
from scm.maps.model import Group, Junction, StopLine
from scm.maps.route import Roads
from scm.traffic.kernel import GroupTimes, Program
from scm.traffic.timing import NIGEL, CarFacts, clearance_s, min_green_s, yellow_s

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
    lines = [
        line
        for line in roads.city_map.stop_lines
        if (line.junction, line.group) == (junction.name, group.name)
    ]
    if not lines:
        msg = f"junction {junction.name}: group {group.name!r} has no stop line on map"
        raise PlanError(f"{msg} {roads.city_map.name}")
    limit_mps = min(roads.lane(line.lane).speed_limit_mps for line in lines)
    limit_mps = min(limit_mps, roads.lane(group.movement.lane).speed_limit_mps)
    way_m = max(_way_m(line, group, roads) for line in lines)
    return GroupTimes(
        min_green=whole_steps_ns(min_green_s(car, limit_mps)),
        yellow=whole_steps_ns(yellow_s(car)),
        clearance=whole_steps_ns(clearance_s(car, way_m, limit_mps)),
    )


def _way_m(line: StopLine, group: Group, roads: Roads) -> float:
    """Return the way from a stop line to the end of its group's movement [m]."""
    movement = group.movement
    if movement.lane == line.lane:
        return movement.to_m - line.at_m
    if movement.lane in roads.successors(line.lane):
        return roads.lane(line.lane).length_m - line.at_m + movement.to_m
    msg = f"stop line {line.name!r}: lane {line.lane!r} does not lead to {movement.lane!r}, the"
    raise PlanError(f"{msg} movement of group {group.name!r} on map {roads.city_map.name}")
