"""Max pressure: green for the stage with the longest queues, less the queues that it would feed.

    pressure(stage) = sum over its groups of (queue before the line - cars standing behind it)

A stage stays at least its least green, and while its cars are worth waiting for, up to max 1: else
every car more elsewhere would cost a change, in which nobody drives. Then the stage of the highest
pressure follows; the present one stays on a tie. Nobody waits for ever: a group that is called and
has waited `STARVED_NS` is served next, whatever the others' pressure.

Rule: Varaiya 2013, Max pressure control of a network of signalized intersections; the least
wait is ours. It needs no knowledge of demand, and nothing of other junctions but the queues.
"""

from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.traffic.signals.detectors import Detector
from scm.traffic.signals.green_extension import (
    GUARANTEED_S,
    coming,
    green_s,
    is_worth_waiting,
    worth_until_s,
)
from scm.traffic.signals.kernel import Phase, Program
from scm.traffic.signals.operator_overrides import NEED_RINGS, groups_of
from scm.traffic.signals.plan import stages, times_of
from scm.traffic.signals.policy import Answer, JunctionView, Mode, Policy, Site, Turn

STARVED_NS = 60 * NS_PER_S  # a called group that has waited for longer is next
SWITCH_AT = 1.0  # car: by how much another stage's pressure must be higher
MANY_GROUPS = 10  # more have too many sets without conflict to compare all


class Memory(NamedTuple):
    """Which groups are green, for how long all of them were, and how long the others wait [ns]."""

    stage: frozenset[str]
    green_ns: int
    waits_ns: tuple[int, ...]


def start(site: Site) -> Memory:
    """Begin with nobody green."""
    return Memory(frozenset(), 0, (0,) * len(site.program.groups))


def step(site: Site, memory: Memory, view: JunctionView) -> tuple[Memory, Answer]:
    """Stay, or choose the next stage."""
    program = site.program
    is_green = [group.phase is Phase.GREEN for group in view.state]
    called = _called(site, memory, view)
    waits = tuple(
        0 if green or name not in called else wait + view.dt_ns
        for name, green, wait in zip(program.groups, is_green, memory.waits_ns, strict=True)
    )
    all_green = all(
        green for name, green in zip(program.groups, is_green, strict=True) if name in memory.stage
    )
    green_ns = memory.green_ns + view.dt_ns if all_green else 0
    stage = memory.stage
    least_ns = max((times_of(program, name).min_green for name in stage), default=0)
    if (
        green_ns >= least_ns
        and (all_green or not stage)
        and not _goes_on(site, memory, view, green_ns)
    ):
        stage = _choose(site, stage, view, called, waits)
    if stage != memory.stage:
        green_ns = 0
    mode: Mode = "preempt" if groups_of(view.overrides, "preempt") else "adaptive"
    return Memory(stage, green_ns, waits), Answer(stage, mode=mode)


def _goes_on(site: Site, memory: Memory, view: JunctionView, green_ns: int) -> bool:
    """Return whether ending the stage costs its cars more than the others gain, up to max 1."""
    if (
        not view.sees
        or groups_of(view.overrides, "preempt")
        or groups_of(view.overrides, "force_off")
    ):
        return False
    numbers = [site.program.groups.index(name) for name in memory.stage if name in view.detectors]
    most_ns = max((site.layout.phases[i].max1 for i in numbers), default=0)
    return green_ns < most_ns and any(is_worth_waiting(site, i, view) for i in numbers)


def foresee(site: Site, memory: Memory, view: JunctionView) -> tuple[Turn, ...]:
    """Return what is left of the present stage, and which one follows by the pressure then."""
    if any(one.verb in NEED_RINGS for one in view.overrides) or not view.sees or not memory.stage:
        return ()
    numbers = [site.program.groups.index(name) for name in memory.stage]
    is_green = all(view.state[i].phase is Phase.GREEN for i in numbers)
    least_s = max(site.program.times[i].min_green for i in numbers) / NS_PER_S
    most_s = max(site.layout.phases[i].max1 for i in numbers) / NS_PER_S
    if is_green:
        spent_s = memory.green_ns / NS_PER_S
        from_s = max(0.0, least_s - spent_s)
        until_s = max(worth_until_s(site, i, view, from_s) for i in numbers)
        left_s = max(from_s, min(until_s, most_s - spent_s)) + GUARANTEED_S
    else:
        clearing_s = max(green_s(site, i, view.detectors[site.program.groups[i]]) for i in numbers)
        left_s = max(least_s + GUARANTEED_S, min(clearing_s, most_s))
    gone = {name: _later(site, view.detectors[name], left_s) for name in memory.stage}
    then = replace(view, detectors={**view.detectors, **gone})
    following = _choose(site, memory.stage, then, _called(site, memory, then), memory.waits_ns)
    if following == memory.stage:
        return (Turn(memory.stage, None),)
    return (Turn(memory.stage, left_s), Turn(following, None))


def _later(site: Site, detector: Detector, after_s: float) -> Detector:
    """Return what is left of the cars of a green after a time."""
    leaves = [at_s for at_s in coming(detector, site.headway_s) if at_s > after_s]
    return Detector(call=bool(leaves), near=len(leaves), ahead=detector.ahead)


def stages_of(program: Program) -> list[frozenset[str]]:
    """Return every largest set of groups without conflict; of many groups, just a cover."""
    if len(program.groups) > MANY_GROUPS:
        return [frozenset(stage) for stage in stages(program)]
    free = [
        frozenset(some)
        for count in range(1, len(program.groups) + 1)
        for some in combinations(program.groups, count)
        if not any(frozenset(pair) in program.conflicts for pair in combinations(some, 2))
    ]
    return [some for some in free if not any(some < other for other in free)]


def _called(site: Site, memory: Memory, view: JunctionView) -> frozenset[str]:
    omitted = groups_of(view.overrides, "omit")
    called = set(groups_of(view.overrides, "call") | groups_of(view.overrides, "preempt"))
    for name in site.program.groups:
        detector = view.detectors.get(name)
        if not view.sees or (detector is not None and detector.call):
            called.add(name)
    return frozenset(called - omitted)


def _choose(
    site: Site,
    now: frozenset[str],
    view: JunctionView,
    called: frozenset[str],
    waits: tuple[int, ...],
) -> frozenset[str]:
    """Return the stage to be green now."""
    preempt = groups_of(view.overrides, "preempt")
    if groups_of(view.overrides, "hold") & now and not preempt:
        return now
    candidates = [s for s in stages_of(site.program) if s & called]
    must = preempt or _starved(site, waits)
    candidates = [s for s in candidates if s & must] or candidates
    if not candidates:
        return now
    forced = groups_of(view.overrides, "force_off") & now
    best = max(candidates, key=lambda stage: _pressure(stage, view, called))
    better = _pressure(best, view, called) - _pressure(now, view, called)
    is_idle = not now & called
    if not (must or forced or is_idle) and better < SWITCH_AT:
        return now
    return best - groups_of(view.overrides, "omit")


def _starved(site: Site, waits: tuple[int, ...]) -> frozenset[str]:
    longest = max(waits)
    if longest < STARVED_NS:
        return frozenset()
    return frozenset((site.program.groups[waits.index(longest)],))


def _pressure(stage: frozenset[str], view: JunctionView, called: frozenset[str]) -> float:
    """Return the pressure of a stage; a car that still drives up counts half."""
    total = 0.0
    for name in stage & called:
        detector = view.detectors.get(name)
        if detector is None:
            total += 1.0
        else:
            total += detector.queue + 0.5 * (detector.near - detector.queue) - detector.ahead
    return total


POLICY = Policy(
    "max pressure: the longest queues first, where there is room for them",
    start,
    step,
    foresee=foresee,
)
