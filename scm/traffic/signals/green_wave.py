"""Green waves: one cycle for all junctions, and for each an offset by which its cycle begins later.

    offset(B) + start of the wave's green at B = offset(A) + its start at A + way(A -> B) / speed

The way runs along the map's lanes from stop line to stop line. Junctions are taken in the map's
order, each from a neighbour that already has an offset: a tree, so one direction of each pair is
in step; the others meet what they meet. Speed is the slowest lane limit on the way, and no more
than the slowest car drives.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from scm.maps.route import Roads
from scm.records.city_map import CityMap, StopLine
from scm.traffic.signals.plan import TimedStage, Timetable
from scm.traffic.signals.program import STEP_NS
from scm.traffic.signals.timing import CarFacts

MAX_OFFSET_ERROR_NS = 1_000_000_000  # later than that is corrected by a longer cycle


class Wave(NamedTuple):
    """The common cycle of a plan, and when this junction's cycle begins in it [ns]."""

    length_ns: int
    offset_ns: int


class Link(NamedTuple):
    """A way from one stop line to the next; how long it takes [s]."""

    start: StopLine
    end: StopLine
    travel_s: float


def links_of(city_map: CityMap, roads: Roads, car: CarFacts) -> list[Link]:
    """Return the shortest way from each stop line to each that comes next."""
    return [link for line in city_map.stop_lines for link in _links_from(line, roads, car)]


def _links_from(line: StopLine, roads: Roads, car: CarFacts) -> list[Link]:
    """Search onward along lanes until the next stop lines."""
    found: dict[str, Link] = {}
    todo = deque([(line.lane, line.at_m, 0.0)])
    passed = set[str]()
    while todo:
        lane, from_m, gone_s = todo.popleft()
        speed_mps = min(car.slow_mps, roads.definition(lane).speed_limit_mps)
        following = next((n for n in roads.stop_lines_on(lane) if n.at_m > from_m), None)
        if following is not None:
            travel_s = gone_s + (following.at_m - from_m) / speed_mps
            found.setdefault(following.name, Link(line, following, travel_s))
            continue
        gone_s += (roads.length_of(lane) - from_m) / speed_mps
        onward = [name for name in roads.successors(lane) if name not in passed]
        passed.update(onward)
        todo += [(name, -1e-9, gone_s) for name in onward]
    return list(found.values())


def waves_of(
    links: Sequence[Link], tables: Mapping[str, Timetable]
) -> dict[str, tuple[Timetable, Wave]]:
    """Return each junction's timetable stretched to the common cycle, and its place in it.

    Args:
        links: Between stop lines.
        tables: Of one plan, by junction.
    """
    length_ns = max(table.length_ns for table in tables.values())
    common = {name: stretch(table, length_ns) for name, table in tables.items()}
    offsets: dict[str, int] = {}
    for first in tables:
        offsets.setdefault(first, 0)
        todo = deque([first])
        while todo:
            here = todo.popleft()
            for link in links:
                start, end = link.start.junction, link.end.junction
                if start == here and end in common and end not in offsets:
                    leaves_ns = offsets[here] + common[here].first_start_ns(link.start.group)
                    there_ns = leaves_ns + round(link.travel_s * 1e9)
                    offsets[end] = there_ns - common[end].first_start_ns(link.end.group)
                    todo.append(end)
    return {name: (common[name], Wave(length_ns, offsets[name] % length_ns)) for name in tables}


def stretch(table: Timetable, length_ns: int) -> Timetable:
    """Return a timetable of another length, no shorter: every green gets an equal share more."""
    extra_ns = length_ns - table.length_ns
    share_ns = extra_ns // len(table.timed_stages) // STEP_NS * STEP_NS
    shares = [share_ns] * len(table.timed_stages)
    shares[0] += extra_ns - sum(shares)
    return _longer(table, shares)


def dwelling(table: Timetable, dwell_ns: int) -> Timetable:
    """Return a timetable whose first green is longer by `dwell_ns`, to come into step."""
    return _longer(table, [dwell_ns] + [0] * (len(table.timed_stages) - 1)) if dwell_ns else table


def dwell_ns(wave: Wave | None, began_ns: int) -> int:
    """Return by how much a cycle must be longer for the next one to begin in step.

    A cycle that is late by less than `MAX_OFFSET_ERROR_NS` stays so: another cycle costs more.
    """
    if wave is None:
        return 0
    missing_ns = (wave.offset_ns - began_ns) % wave.length_ns
    return 0 if wave.length_ns - missing_ns < MAX_OFFSET_ERROR_NS else missing_ns


def _longer(table: Timetable, shares: Sequence[int]) -> Timetable:
    timed_stages, moved_ns = [], 0
    for timed, share_ns in zip(table.timed_stages, shares, strict=True):
        start_ns = timed.start_ns + moved_ns
        moved_ns += share_ns
        timed_stages.append(TimedStage(timed.groups, start_ns, timed.end_ns + moved_ns))
    return Timetable(table.plan, tuple(timed_stages), table.length_ns + moved_ns)
