"""When a colour will end: promises for SPaT that are kept whatever anybody asks for.

A plan only ever changes at the end of a cycle. So inside a cycle every end is known; and of the
first red end beyond it, only that some plan's cycle begins there: the earliest start of all plans
is promised as the minimum, the latest as the maximum. When the next cycle begins, the promise
narrows to one of them; it never widens. The maximum allows for two late steps of the controller.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from scm.traffic.plan import Timetable
from scm.traffic.program import STEP_NS

SLACK_NS = 2 * STEP_NS


@dataclass(frozen=True, slots=True)
class Promise:
    """A colour ends not before `min_end_ns` and not after `max_end_ns` (None: not known)."""

    min_end_ns: int
    max_end_ns: int | None


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


def end_after(end_ns: int) -> Promise:
    """Return the promise of an end that is due at a known time."""
    return Promise(end_ns, end_ns + SLACK_NS)


def green_end(group: str, cycle: Cycle, now_ns: int, min_green_ns: int) -> Promise:
    """Return when a green that starts now will end."""
    least_ns = now_ns + min_green_ns
    slot = cycle.timetable and cycle.timetable.slot_of(group, now_ns - cycle.began_ns)
    return end_after(max(cycle.began_ns + slot.end_ns, least_ns) if slot else least_ns)


def red_end(group: str, cycle: Cycle, now_ns: int, plans: Iterable[Timetable]) -> Promise:
    """Return when a red will end; `plans` are all that may run in the next cycle."""
    slot = cycle.timetable and cycle.timetable.slot_of(group, now_ns - cycle.began_ns)
    if slot:
        return end_after(cycle.began_ns + slot.start_ns)
    starts = [plan.first_start_ns(group) for plan in plans]
    return Promise(cycle.ends_ns + min(starts), cycle.ends_ns + max(starts) + SLACK_NS)
