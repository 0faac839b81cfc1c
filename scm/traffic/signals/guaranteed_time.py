"""Guaranteed times of SPaT: when a colour will end, whatever is requested.

Under a timetable a plan changes only at the end of a cycle. So inside a cycle every end is
known. The first red end beyond it lies between the earliest and the latest start of all plans; it
narrows to one of them when the next cycle begins, and never widens. The maximum allows for two late
steps. A green of the last stage may go on in the next cycle: until that is decided, when the last
stage begins, its minimum is the end of that stage and its maximum the latest end of any plan.

Under any other policy a green has no known end. While it is requested it is guaranteed for
`GREEN_NOTICE_NS` more at every step, so a car that receives two SPATEM a second can lose one; once
it is no longer requested, its end is known. A red lasts at least as long as the kernel requires;
its maximum is unknown.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scm.traffic.signals.kernel import GroupTimes, Phase, Program, State
from scm.traffic.signals.plan import Timetable
from scm.traffic.signals.program import STEP_NS

LATE_STEPS_NS = 2 * STEP_NS  # by which late steps may put an end off
GREEN_NOTICE_NS = 10 * STEP_NS  # for which a requested green is guaranteed: two SPATEM


@dataclass(frozen=True, slots=True)
class GuaranteedTime:
    """A colour ends not before `min_end_ns` and not after `max_end_ns` (None: not known)."""

    min_end_ns: int
    max_end_ns: int | None

    @property
    def is_exact(self) -> bool:
        """Whether the end is known but for late steps."""
        return self.max_end_ns is not None and self.max_end_ns - self.min_end_ns <= LATE_STEPS_NS

    def narrowed(self, by: "GuaranteedTime") -> "GuaranteedTime":
        """Return what is left when both hold."""
        known = [end for end in (self.max_end_ns, by.max_end_ns) if end is not None]
        return GuaranteedTime(max(self.min_end_ns, by.min_end_ns), min(known, default=None))


@dataclass(frozen=True, slots=True)
class Cycle:
    """The cycle that runs now; before the first one `timetable` is None.

    Attributes:
        began_ns: When its position was 0.
        ends_ns: When the next one begins.
    """

    timetable: Timetable | None
    began_ns: int
    ends_ns: int

    def next_change_ns(self, now_ns: int) -> int:
        """Return when a stage begins or ends next, or the cycle ends; now, if that is over."""
        stages = self.timetable.timed_stages if self.timetable is not None else ()
        changes = [self.ends_ns]
        for timed in stages:
            changes += (self.began_ns + timed.start_ns, self.began_ns + timed.end_ns)
        return min((change for change in changes if change > now_ns), default=now_ns)


def end_after(end_ns: int) -> GuaranteedTime:
    """Return the guaranteed time of an end that is due at a known time."""
    return GuaranteedTime(end_ns, end_ns + LATE_STEPS_NS)


def green_end(
    group: str, cycle: Cycle, now_ns: int, least_ns: int, onward: Iterable[Timetable | None]
) -> GuaranteedTime:
    """Return when a green that is on will end.

    Args:
        group: Which one.
        cycle: That runs now.
        now_ns: The present time.
        least_ns: When it may end at the earliest.
        onward: Timetables in whose cycle it may go on after this one; None: it may go on in none.
    """
    if cycle.timetable is None:
        return end_after(least_ns)
    green = cycle.timetable.green_of(group, now_ns - cycle.began_ns)
    last_ns = cycle.began_ns + cycle.timetable.timed_stages[-1].end_ns
    if green is not None and cycle.began_ns + green.end_ns < last_ns:
        return end_after(max(cycle.began_ns + green.end_ns, least_ns))
    ends_ns, is_open = [], False
    for table in onward:
        if table is None or group not in table.timed_stages[0].groups:
            ends_ns.append(last_ns)
            continue
        first = table.greens_of(group)[0]
        ends_ns.append(cycle.ends_ns + first.end_ns)
        is_open |= (
            first.end_ns == table.timed_stages[-1].end_ns
        )  # perhaps beyond that cycle as well
    latest_ns = None if is_open else max(*ends_ns, least_ns) + LATE_STEPS_NS
    return GuaranteedTime(max(min(ends_ns), least_ns), latest_ns)


def red_end(group: str, cycle: Cycle, now_ns: int, plans: Iterable[Timetable]) -> GuaranteedTime:
    """Return when a red will end.

    Args:
        group: Which one.
        cycle: That runs now.
        now_ns: The present time.
        plans: All that may run in the next cycle; none: another policy follows it.
    """
    green = cycle.timetable and cycle.timetable.green_of(group, now_ns - cycle.began_ns)
    if green:
        return end_after(cycle.began_ns + green.start_ns)
    starts = [plan.first_start_ns(group) for plan in plans]
    if not starts:
        return GuaranteedTime(cycle.ends_ns, None)
    return GuaranteedTime(cycle.ends_ns + min(starts), cycle.ends_ns + max(starts) + LATE_STEPS_NS)


def requested_green(
    before: GuaranteedTime | None, now_ns: int, least_ns: int, *, requested: bool
) -> GuaranteedTime:
    """Return the guaranteed time of a green outside of timetables; None: it begins now."""
    if before is None:
        return GuaranteedTime(now_ns + max(least_ns, GREEN_NOTICE_NS), None)
    if before.max_end_ns is not None:
        return before
    if requested:
        return GuaranteedTime(max(before.min_end_ns, now_ns + GREEN_NOTICE_NS), None)
    return end_after(max(before.min_end_ns, now_ns))


def earliest_green(
    program: Program, state: State, number: int, ends: Sequence[GuaranteedTime | None], now_ns: int
) -> GuaranteedTime:
    """Return the guaranteed time of a red that only the kernel is certain to keep.

    Args:
        program: Of the junction.
        state: Of its kernel.
        number: Of the red group.
        ends: The guaranteed time of every group's colour; None: not yet.
        now_ns: The present time.
    """
    left = [still_ns(state, number, program.times[number], ends[number], now_ns)]
    for other, name in enumerate(program.groups):
        if frozenset((program.groups[number], name)) in program.conflicts:
            left.append(still_ns(state, other, program.times[other], ends[other], now_ns))
    return GuaranteedTime(now_ns + max(left), None)


def still_ns(
    state: State, number: int, times: GroupTimes, guaranteed: GuaranteedTime | None, now_ns: int
) -> int:
    """Return for how long a group blocks others, or its own next green, at the least [ns]."""
    phase, elapsed_ns = state[number]
    match phase:
        case Phase.GREEN:
            least_ns = times.min_green - elapsed_ns
            guaranteed_ns = 0 if guaranteed is None else guaranteed.min_end_ns - now_ns
            return max(least_ns, guaranteed_ns, 0) + times.yellow + times.clearance
        case Phase.YELLOW:
            return times.yellow - elapsed_ns + times.clearance
        case Phase.CLEARANCE:
            return times.clearance - elapsed_ns
        case _:
            return 0
