"""A recording as it is compared with a car: screened row by row, repaired, cut at its gaps.

Each stretch between gaps is driven again on its own.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from scm.arrays import Bools, Floats
from scm.data_quality.check import check
from scm.data_quality.encoder_counts import repaired_counters
from scm.data_quality.expected_motion import limits_of
from scm.data_quality.pose_track import LONG_GAP_S, POSE, long_gaps
from scm.data_quality.quality import DataProblem, Quality, Span, called, folded
from scm.data_quality.repairs import corrected
from scm.data_quality.row_spacing import without_bursts
from scm.data_quality.spikes import without_spikes
from scm.data_quality.timestamps import (
    Table,
    count_of,
    in_order,
    in_seconds,
    same_stamps,
    tables_of,
    with_numbers,
    without_repeats,
    without_strays,
)
from scm.errors import RecordingError
from scm.recording.columns import LeftOut
from scm.recording.read import Channel, Recording
from scm.vehicles.car import Car
from scm.vehicles.drive_channel import drive_name

REPAIRS = ("unit", "sign", "clock", "clipped", "wrapped", "assumed")
UNCHANGED = ("not_finite", "assumed")  # a cell without a number is no row that was changed
MOST_REASONS = 10  # lines of an account; more of them mean the wrong file
SHORTEST_S = 2.0  # a second to settle the actuators in, and one to compare
FEWEST_POSES = 8
EDGE_S = 0.5 * LONG_GAP_S  # tables do not stop at one row: rows that soon after belong to it
RUN_IN_S = 2.0  # of commands before a stretch: where servo and lags stand when it begins
STEERING = "command.steering"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A recording as it is compared with a car.

    Attributes:
        recordings: Its stretches without gaps, in time order, repaired.
        problems: All that was found in it.
        account: What was read, left out, repaired and cut, a line each.
        quality: Of the whole recording.
    """

    recordings: tuple[Recording, ...]
    problems: tuple[DataProblem, ...]
    account: tuple[str, ...]
    quality: Quality


def prepare(recording: Recording, car: Car, *, strict: bool = False) -> Prepared:
    """Return a recording screened row by row, cut at its gaps and repaired.

    Args:
        recording: As it was read; it is not changed.
        car: Whose recording it is: it says how fast a car can go and turn.
        strict: Refuse a recording in which anything has to be left out or repaired.

    Raises:
        RecordingError: when `strict` is set and the recording is not in order.
    """
    screened = screen(recording, car)
    quality = check(screened.recording, car)
    cut = stretches(corrected(screened.recording, quality), car, screened.jumps)
    found = [p for p in quality.problems if not cut.explains(p)]
    done = (*screened.problems, *(p for p in found if p.name in REPAIRS and p.corrected))
    changes = folded((*done, *cut.problems))
    account = _account(tables_of(recording), recording.left_out, changes)
    no_rows = any(one.line is not None for one in recording.left_out)
    if strict and (no_rows or any(p.name not in UNCHANGED for p in changes)):
        refused = "".join(f"\n  {line}" for line in account[1:])
        msg = f"{recording.path}: --strict refuses to leave out, repair or cut:{refused}"
        raise RecordingError(msg)
    return Prepared(
        recordings=cut.recordings,
        problems=folded((*screened.problems, *found, *cut.problems)),
        account=account,
        quality=quality,
    )


def _account(
    tables: Sequence[Table], left_out: Sequence[LeftOut], changes: Sequence[DataProblem]
) -> tuple[str, ...]:
    """Return which rows were read, and a line for each change: of a whole table by its file."""
    files = {called(table.names): table.label for table in tables if len(table.names) > 1}
    files |= {"*": "all tables"}
    read = "read " + "; ".join(map(_rows_of, tables))
    return (
        read,
        *lines_left_out(left_out),
        *(f"{files.get(p.channel, p.channel)}: {p.text} {p.corrected}".rstrip() for p in changes),
    )


def _rows_of(table: Table) -> str:
    if table.source is None:
        return f"{table.label}: {count_of(len(table.t))}"
    excluded = table.source.excluded
    left = f", {excluded} of them excluded by `where`" if excluded else ""
    return f"{table.label}: {count_of(table.source.rows)}{left}"


def lines_left_out(left_out: Iterable[LeftOut]) -> tuple[str, ...]:
    """Return what a recording's files hold that was not read: what is alike in one sentence."""
    alike: dict[tuple[str, str], list[LeftOut]] = {}
    for one in left_out:
        alike.setdefault((one.file, one.why), []).append(one)
    lines = []
    for (file, why), some in list(alike.items())[:MOST_REASONS]:
        first = ", ".join(str(one.line) for one in some[:3])
        more = f" and {len(some) - 3} more" if len(some) > 3 else ""
        lines.append(f"{file}: lines {first}{more}: {why}" if len(some) > 1 else str(some[0]))
    rest = sum(map(len, list(alike.values())[MOST_REASONS:]))
    return (*lines, f"and {rest} more lines that are no rows") if rest else tuple(lines)


@dataclass(frozen=True, slots=True)
class Screened:
    """A recording whose rows are in order.

    Attributes:
        problems: Everything that was done to its rows.
        jumps: Spans over which its poses jump.
    """

    recording: Recording
    problems: tuple[DataProblem, ...]
    jumps: tuple[Span, ...]


def screen(recording: Recording, car: Car) -> Screened:
    """Return a recording with its rows in order, each possible for its car; it is not changed."""
    limits = limits_of(car)
    now, problems = with_numbers(recording)
    for step in (
        partial(in_seconds, limits=limits),
        without_strays,
        in_order,
        without_bursts,
        without_repeats,
    ):
        now, found = step(now)
        problems += found
    now, found, jumps = without_spikes(now, limits)
    problems += found
    now, found = repaired_counters(now, limits)
    return Screened(now, (*problems, *found), jumps)


@dataclass(frozen=True, slots=True)
class Stretches:
    """What a recording was cut into.

    Attributes:
        recordings: In the order of time; of a recording without such gaps the very recording.
        problems: Where it was cut, and which rows are in no stretch.
    """

    recordings: tuple[Recording, ...]
    problems: tuple[DataProblem, ...] = ()

    def explains(self, other: DataProblem) -> bool:
        """Return whether another problem names nothing but the gaps at which this was cut."""
        cut = {gap for problem in self.problems for gap in problem.when_s or ()}
        return (
            other.name == "gap"
            and bool(cut)
            and all(
                any(first <= begin and end <= last for first, last in cut)
                for begin, end in other.when_s or ()
            )
        )


def stretches(recording: Recording, car: Car, jumps: Sequence[Span] = ()) -> Stretches:
    """Cut a repaired recording where its poses or what drives the car are missing for long.

    All its tables are cut at the same moments, and where the poses jump. Other sensors may pause:
    they are compared where they are. A stretch that is too short to be driven again is left out,
    with a problem that says which rows.
    """
    needed = (drive_name(recording, car), STEERING, *POSE)
    if any(len(_stamps(recording, name)) == 0 for name in needed):
        return Stretches((recording,))
    gaps = long_gaps(*(_stamps(recording, name) for name in needed))
    if not gaps and not jumps:
        return Stretches((recording,))
    cuts = sorted([*((first + EDGE_S, last - EDGE_S) for first, last in gaps), *jumps])
    ends = [-np.inf, *(moment for cut in cuts for moment in cut), np.inf]
    parts = [
        between(recording, first, last) for first, last in zip(ends[::2], ends[1::2], strict=True)
    ]
    whole = tuple(part for part in parts if _can_be_driven(part, needed))
    silent = [name for name in needed if long_gaps(_stamps(recording, name))]
    return Stretches(whole, (_problem(recording, silent, gaps, jumps, whole),))


def _stamps(recording: Recording, name: str) -> Floats:
    channel = recording.channels.get(name)
    return np.empty(0) if channel is None else channel.t


def between(recording: Recording, first: float, last: float) -> Recording:
    """Return what was recorded between two moments, and the commands that lead there."""
    channels = dict[str, Channel]()
    for name, channel in recording.channels.items():
        rows = (channel.t >= first) & (channel.t <= last)
        if name.startswith("command."):
            rows |= _leading(channel.t, first)
        if rows.any():
            channels[name] = replace(channel, t=channel.t[rows], values=channel.values[rows])
    scans = recording.scans and recording.scans.between(first, last)
    return replace(recording, channels=channels, scans=scans)


def _leading(t: Floats, first: float) -> Bools:
    """Return the command rows before a moment that still matter there: the last one is held."""
    before = np.flatnonzero(t < first)
    rows = (t >= first - RUN_IN_S) & (t < first)
    rows[before[-1:]] = True
    return rows


def _can_be_driven(part: Recording, needed: Sequence[str]) -> bool:
    """Return whether poses and commands are there together for long enough."""
    if any(name not in part.channels for name in needed):
        return False
    times = [part.channels[name].t for name in needed]
    posed = all(len(part.channels[name].t) >= FEWEST_POSES for name in POSE)
    return posed and min(t[-1] for t in times) - max(t[0] for t in times) >= SHORTEST_S


def _problem(
    recording: Recording,
    silent: Sequence[str],
    gaps: Sequence[Span],
    jumps: Sequence[Span],
    whole: Sequence[Recording],
) -> DataProblem:
    """Say where a recording was cut, and which of its rows are in no stretch."""
    causes = []
    if gaps:
        longest_s = max(last - first for first, last in gaps)
        often = "" if len(gaps) == 1 else f"{len(gaps)} times, at most "
        causes.append(f"{_missing(silent)} are missing {often}for {longest_s:.1f} s")
    if jumps:
        often = "once" if len(jumps) == 1 else f"{len(jumps)} times"
        causes.append(f"{'the' if gaps else 'The'} poses jump {often}")
    rest = {
        0: f"no stretch of {SHORTEST_S:g} s is left",
        1: "one stretch of it is driven again",
    }.get(len(whole), f"{len(whole)} stretches of it are driven again, each on its own")
    lost = [
        f"{count} of {len(recording.channels[names[0]].t)} rows of {called(names)}"
        for names in same_stamps(recording)
        if (count := _lost(recording, names[0], whole))
    ]
    text = f"{', and '.join(causes)}: {rest}."
    if lost:
        text += f" Not in a stretch of {SHORTEST_S:g} s that has both: {', '.join(lost)}."
    return DataProblem(
        channel=called(silent) if gaps and not jumps else "*",
        name="gap",
        text=text,
        when_s=tuple(sorted([*gaps, *jumps])),
        corrected="Cut there.",
        record_instead="Record poses and commands without pauses, or one file a drive.",
    )


def _missing(silent: Sequence[str]) -> str:
    """Return what is missing at the gaps, in words."""
    posed = any(name in POSE for name in silent)
    commanded = any(name not in POSE for name in silent)
    return "Poses" if not commanded else "Commands" if not posed else "Poses or commands"


def _lost(recording: Recording, name: str, whole: Iterable[Recording]) -> int:
    """Return how many rows of a channel are in no stretch."""
    t = recording.channels[name].t
    parts = [part.channels[name].t for part in whole if name in part.channels]
    return int((~np.isin(t, np.concatenate(parts))).sum()) if parts else len(t)
