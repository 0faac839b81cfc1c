"""Green extension: whether waiting for the cars that come costs less than ending the green.

    k-th of them passes in     at_k: where it drives, or k headways of a queue that sets off
    ending now costs it        max(0, red - at_k) + one start from rest
    waiting for it costs       each conflicting car max(0, at_k + change - arrival)
                               - max(0, change - arrival)

`red` is the red that follows: this change, and for each called group in conflict what its cars take
to leave, no less than its least green, and its change. A green goes on as long as there is a k for
which the first k cars would lose more than all others. A car that passes within the guaranteed
green needs no more of it.
"""

from collections.abc import Iterable

from scm.clock import NS_PER_S
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.guaranteed_time import GREEN_NOTICE_NS
from scm.traffic.signals.policy import JunctionView, Site

START_LOSS_S = 1.0  # what a start from rest costs a car
GUARANTEED_S = GREEN_NOTICE_NS / NS_PER_S


def is_worth_waiting(site: Site, number: int, view: JunctionView) -> bool:
    """Return whether the green of a group should go on, by its number."""
    comes = coming(view.detectors[site.program.groups[number]], site.headway_s)
    return bool(comes) and _is_worth(comes, *_conflicting_demand(site, number, view))


def worth_until_s(site: Site, number: int, view: JunctionView, from_s: float) -> float:
    """Return until when the green of a group will be worth going on from a time on [s from now].

    It is decided again whenever one of the cars that are known by now needs no more of it.
    """
    comes = coming(view.detectors[site.program.groups[number]], site.headway_s)
    red_s, change_s, waiting = _conflicting_demand(site, number, view)
    until_s = from_s
    for place, at_s in enumerate(comes):
        if at_s - until_s <= GUARANTEED_S:
            continue
        left = [one - until_s for one in comes[place:]]
        there = [max(0.0, one - until_s) for one in waiting]
        if not _is_worth(left, red_s, change_s, there):
            break
        until_s = at_s - GUARANTEED_S
    return until_s


def _conflicting_demand(
    site: Site, number: int, view: JunctionView
) -> tuple[float, float, list[float]]:  # fmt: skip
    """Return the red that follows a green, the change before it, and when the others' cars come."""
    change_s = _change_s(site, number)
    conflicting = conflicting_groups(site, number, view)
    red_s = change_s + sum(_served_s(site, i, view) for i in conflicting)
    waiting = [
        at_s for i in conflicting for at_s in _arrivals(view.detectors[site.program.groups[i]])
    ]
    return red_s, change_s, waiting


def _is_worth(comes: list[float], red_s: float, change_s: float, waiting: list[float]) -> bool:
    """Return whether there is a first of those who come that is worth waiting for."""
    saved = 0.0
    for at_s in comes:
        saved += max(0.0, red_s - at_s) + START_LOSS_S
        lost = sum(
            max(0.0, at_s + change_s - there_s) - max(0.0, change_s - there_s)
            for there_s in waiting
        )
        if lost < saved:
            return True
    return False


def coming(detector: Detector, headway_s: float) -> list[float]:
    """Return when the cars that need more than the guaranteed green will pass the line [s]."""
    standing = max(0, detector.near - len(detector.arrivals_s))
    leaves = [(k + 1) * headway_s for k in range(standing)]
    return sorted(at_s for at_s in (*leaves, *detector.arrivals_s) if at_s > GUARANTEED_S)


def conflicting_groups(site: Site, number: int, view: JunctionView) -> list[int]:
    """Return the groups in conflict with one that have detectors."""
    names = site.program.groups
    return [
        other
        for other, name in enumerate(names)
        if frozenset((name, names[number])) in site.program.conflicts and name in view.detectors
    ]


def _arrivals(detector: Detector) -> Iterable[float]:
    """Return when the cars of a red group are at its line; 0: they stand."""
    standing = max(0, detector.near - len(detector.arrivals_s))
    return (*(0.0,) * standing, *detector.arrivals_s)


def _change_s(site: Site, number: int) -> float:
    times = site.program.times[number]
    return (times.yellow + times.clearance) / NS_PER_S


def _served_s(site: Site, number: int, view: JunctionView) -> float:
    """Return how long the turn of a group in conflict takes; 0 while nobody calls it."""
    detector = view.detectors[site.program.groups[number]]
    if not detector.call:
        return 0.0
    return green_s(site, number, detector) + _change_s(site, number)


def green_s(site: Site, number: int, detector: Detector) -> float:
    """Return the green that a group's cars take to leave, no less than its least [s]."""
    least_s = site.program.times[number].min_green / NS_PER_S
    return max(least_s, detector.near * site.headway_s)
