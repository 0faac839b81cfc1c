"""Forecasts of when a colour will end, beside the guaranteed time; never a guarantee.

A policy foresees turns: who is green, for how much longer, and who comes then, if no further cars
appear. Here the kernel's times are put between them:

    end of a green    what is left of its turn, and the second for which it is guaranteed then
    end of a red      end of the turn before, its yellow and clearance, in turns that follow

The guaranteed time bounds it. Its confidence was measured (`docs/signals.md`). A policy that
foresees nothing leaves it unknown.
"""

from collections.abc import Sequence
from typing import NamedTuple

from scm.clock import NS_PER_S
from scm.traffic.signals.guaranteed_time import GuaranteedTime, still_ns
from scm.traffic.signals.kernel import Phase, Program, State
from scm.traffic.signals.policy import Turn

# Shares of forecasts that came true within a second, measured on a grid full of cars, where
# forecasting is hardest; the lower of two policies.
EXACT_CONFIDENCE = 1.0  # the end is guaranteed
PLANNED_CONFIDENCE = 0.98  # a timetable's next cycle: another plan may still be requested
CLEARING_CONFIDENCE = 0.98  # of a red with nothing left but the kernel's own times
CONFIDENCE_UP_TO_S = ((0.05, 0.68), (0.5, 0.85), (2.0, 0.75), (16.0, 0.45))  # beyond the guarantee
BEYOND_CONFIDENCE = 0.21  # further beyond it


class Likely(NamedTuple):
    """A colour's likely end, and the share of such forecasts that come true within a second."""

    end_ns: int
    confidence: float


def within(
    guaranteed: GuaranteedTime, forecast_ns: int | None, now_ns: int, *, red: bool, planned: bool
) -> Likely | None:
    """Return a forecast within the guaranteed time; an exact guarantee needs none.

    Args:
        guaranteed: Of the colour that is shown.
        forecast_ns: Its likely end; None: unknown.
        now_ns: The present time.
        red: Whether it is red.
        planned: Whether a timetable says so.
    """
    latest_ns = guaranteed.max_end_ns
    if guaranteed.is_exact:
        return Likely(guaranteed.min_end_ns, EXACT_CONFIDENCE)
    if forecast_ns is None:
        return None
    earliest_ns = max(guaranteed.min_end_ns, now_ns)
    end_ns = max(forecast_ns, earliest_ns)
    if latest_ns is not None:
        end_ns = min(end_ns, latest_ns)
    return Likely(end_ns, PLANNED_CONFIDENCE if planned else _share(end_ns - earliest_ns, red=red))


def _share(beyond_ns: int, *, red: bool) -> float:
    """Return how often a forecast comes true that goes so far beyond the guarantee."""
    beyond_s = beyond_ns / NS_PER_S
    if red and beyond_s <= CONFIDENCE_UP_TO_S[0][0]:
        return CLEARING_CONFIDENCE
    return next(
        (share for most_s, share in CONFIDENCE_UP_TO_S if beyond_s <= most_s), BEYOND_CONFIDENCE
    )


class Coming(NamedTuple):
    """A green that is on or to come [ns]; without an end: it is unknown."""

    groups: frozenset[str]
    start_ns: int
    end_ns: int | None


def schedule(
    program: Program,
    state: State,
    guarantees: Sequence[GuaranteedTime | None],
    turns: Sequence[Turn],
    now_ns: int,
) -> list[Coming]:
    """Return turns with the kernel's times between them.

    Args:
        program: Of the junction.
        state: Of its kernel.
        guarantees: The guaranteed time of every group's colour; None: not yet.
        turns: That the policy foresees, what is green now first.
        now_ns: The present time.
    """
    green = _green(program, state)
    at_ns, before = now_ns, frozenset[str]()
    scheduled: list[Coming] = []
    for turn in turns:
        entering = turn.groups - before - green
        at_ns += _change_ns(program, before - turn.groups, entering)
        if not scheduled:
            at_ns += _cleared_ns(program, state, guarantees, entering, now_ns)
        if turn.green_s is None:
            return [*scheduled, Coming(turn.groups, at_ns, None)]
        scheduled.append(Coming(turn.groups, at_ns, at_ns + round(turn.green_s * NS_PER_S)))
        at_ns, before = at_ns + round(turn.green_s * NS_PER_S), turn.groups
    return scheduled


def forecasts(program: Program, state: State, coming: Sequence[Coming]) -> dict[str, int]:
    """Return the likely ends of the present colours [ns], of the groups whose end is known.

    Args:
        program: Of the junction.
        state: Of its kernel.
        coming: From `schedule`.
    """
    ends: dict[str, int] = {}
    green, before = _green(program, state), frozenset[str]()
    for number, turn in enumerate(coming):
        for name in turn.groups - before - green:
            ends.setdefault(name, turn.start_ns)
        if turn.end_ns is None:
            break
        following = coming[number + 1].groups if number + 1 < len(coming) else frozenset[str]()
        for name in (turn.groups & green) - following:
            ends.setdefault(name, turn.end_ns)
        before = turn.groups
    return ends


def _green(program: Program, state: State) -> set[str]:
    pairs = zip(program.groups, state, strict=True)
    return {name for name, group in pairs if group.phase is Phase.GREEN}


def _change_ns(program: Program, leaving: frozenset[str], entering: frozenset[str]) -> int:
    """Return how long it takes from the end of some greens to the begin of others [ns]."""
    return max(
        (
            times.yellow + times.clearance
            for name, times in zip(program.groups, program.times, strict=True)
            if name in leaving and any(frozenset((name, e)) in program.conflicts for e in entering)
        ),
        default=0,
    )


def _cleared_ns(
    program: Program,
    state: State,
    guarantees: Sequence[GuaranteedTime | None],
    entering: frozenset[str],
    now_ns: int,
) -> int:
    """Return for how long those who went before still are in the way of some [ns]."""
    return max(
        (
            still_ns(state, number, program.times[number], guarantees[number], now_ns)
            for number, name in enumerate(program.groups)
            if any(frozenset((name, e)) in program.conflicts for e in entering)
        ),
        default=0,
    )
