"""The contract of a fixed-time plan, and its timetable for one junction.

A plan is one file of `plans/` with a constant `PLAN`. It is parametric: from a junction's program
it makes a cycle of stages, each a set of groups that are green together, and for how long. Yellow
and clearance between two stages are not the plan's business: the timetable adds what the kernel
takes, and a step for each of the three changes between two greens, so that late steps never push
the next stage: SPaT's guaranteed times rely on that.

A group of two stages that follow each other stays green between them, and only groups that leave
need time. At a cycle's end too, if the next cycle begins with it; since that may be another plan's,
there is room for the yellow and clearance of all.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import NamedTuple

from scm import registry
from scm.errors import PlanError
from scm.traffic.signals.kernel import GroupTimes, Program
from scm.traffic.signals.program import STEP_NS

PACKAGE = "scm.traffic.signals.plans"
FLASH = "flash"


@dataclass(frozen=True, slots=True)
class Stage:
    """Groups that are green together, for how long, and how much later the next stage is [ns]."""

    groups: tuple[str, ...]
    green_ns: int
    extra_red_ns: int = 0


@dataclass(frozen=True, slots=True)
class Plan:
    """A plug-in: what it is for, in one sentence, and how it makes a cycle of stages."""

    about: str
    cycle: Callable[[Program], tuple[Stage, ...]]


@dataclass(frozen=True, slots=True)
class TimedStage:
    """A stage with its place in the cycle: green is requested from `start_ns` to `end_ns`."""

    groups: frozenset[str]
    start_ns: int
    end_ns: int


class Green(NamedTuple):
    """A group's green in a cycle, through all stages that it lasts [ns]."""

    start_ns: int
    end_ns: int


@dataclass(frozen=True, slots=True)
class Timetable:
    """One cycle of a plan at one junction; positions count from its start [ns]."""

    plan: str
    timed_stages: tuple[TimedStage, ...]
    length_ns: int

    def requested(self, position_ns: int, going_on: frozenset[str] = frozenset()) -> frozenset[str]:
        """Return the groups requested green at a position of the cycle.

        Args:
            position_ns: Where.
            going_on: Who stays green from the last stage into the next cycle.
        """
        before = frozenset[str]()
        for timed in self.timed_stages:
            if position_ns < timed.start_ns:
                return before & timed.groups
            if position_ns < timed.end_ns:
                return timed.groups
            before = timed.groups
        return going_on if position_ns < self.length_ns else frozenset()

    def into(self, following: "Timetable") -> frozenset[str]:
        """Return who stays green when a cycle of `following` comes next."""
        return self.timed_stages[-1].groups & following.timed_stages[0].groups

    def greens_of(self, group: str) -> list[Green]:
        """Return the group's greens in their order; stages that follow each other make one."""
        greens: list[Green] = []
        before = frozenset[str]()
        for timed in self.timed_stages:
            if group in before & timed.groups:
                greens[-1] = Green(greens[-1].start_ns, timed.end_ns)
            elif group in timed.groups:
                greens.append(Green(timed.start_ns, timed.end_ns))
            before = timed.groups
        return greens

    def green_of(self, group: str, position_ns: int) -> Green | None:
        """Return the group's green that is on, or the next one in this cycle."""
        return next((one for one in self.greens_of(group) if position_ns < one.end_ns), None)

    def first_start_ns(self, group: str) -> int:
        """Return when the group's first green of a cycle begins."""
        return min(timed.start_ns for timed in self.timed_stages if group in timed.groups)


def plan_names() -> list[str]:
    """Return the names of all plans that can be requested."""
    return registry.names(PACKAGE)


def times_of(program: Program, group: str) -> GroupTimes:
    """Return the least times of a group."""
    return program.times[program.groups.index(group)]


def green_ns(program: Program, groups: tuple[str, ...]) -> int:
    """Return the shortest green that all of these groups may have together [ns]."""
    return max(times_of(program, group).min_green for group in groups)


def stages(program: Program) -> tuple[tuple[str, ...], ...]:
    """Return sets of groups without conflict that together hold every group once.

    Greedy, in the map's order: each set takes every later group that fits.
    """
    left = list(program.groups)
    found: list[tuple[str, ...]] = []
    while left:
        stage: list[str] = []
        for group in left:
            if all(frozenset((group, other)) not in program.conflicts for other in stage):
                stage.append(group)
        left = [group for group in left if group not in stage]
        found.append(tuple(stage))
    return tuple(found)


def load_timetable(name: str, program: Program) -> Timetable:
    """Return the cycle of a plan by name for one junction.

    Raises:
        PlanError: when there is no such plan, or its cycle is not safe or leaves somebody out.
    """
    plan = registry.load(PACKAGE, name, "PLAN", Plan, error=PlanError)
    return timetable(name, plan.cycle(program), program)


def timetable(name: str, cycle: tuple[Stage, ...], program: Program) -> Timetable:
    """Return the timetable of a cycle of stages.

    Raises:
        PlanError: naming every problem of the cycle at once.
    """
    problems = [problem for stage in cycle for problem in _problems(stage, program)]
    served = {group for stage in cycle for group in stage.groups}
    problems += [
        f"group {group!r} is never green" for group in program.groups if group not in served
    ]
    if problems:
        raise PlanError(f"plan {name!r}: " + "; ".join(problems))
    timed_stages: list[TimedStage] = []
    position_ns = 0
    for number, stage in enumerate(cycle, 1):
        end_ns = position_ns + stage.green_ns
        timed_stages.append(TimedStage(frozenset(stage.groups), position_ns, end_ns))
        following = cycle[number].groups if number < len(cycle) else ()
        between_ns = least_between_ns(stage.groups, following, program)
        position_ns = end_ns + between_ns + stage.extra_red_ns
    return Timetable(name, tuple(timed_stages), position_ns)


def least_between_ns(groups: Collection[str], following: Collection[str], program: Program) -> int:
    """Return the least time from the end of a stage's green to the next one's [ns].

    Args:
        groups: Of the stage.
        following: Of the next one in its cycle; none: it is the last one.
        program: Of the junction.
    """
    leaving = [times_of(program, group) for group in groups if group not in following]
    return max(t.yellow + t.clearance for t in leaving) + 3 * STEP_NS if leaving else 0


def _problems(stage: Stage, program: Program) -> list[str]:
    unknown = [group for group in stage.groups if group not in program.groups]
    if unknown or not stage.groups:
        return [f"stage {stage.groups}: expected groups of {program.groups}"]
    clashes = [
        f"{first!r} and {second!r} conflict but share a stage"
        for first in stage.groups
        for second in stage.groups
        if first < second and frozenset((first, second)) in program.conflicts
    ]
    least_ns = green_ns(program, stage.groups)
    if stage.green_ns < least_ns:
        got_s, least_s = stage.green_ns / 1e9, least_ns / 1e9
        clashes.append(f"stage {stage.groups}: green {got_s} s, expected at least {least_s} s")
    return clashes
