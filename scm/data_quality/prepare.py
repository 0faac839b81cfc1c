"""A recording as it is compared with a car: screened row by row, repaired, cut at gaps."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

from scm.data_quality.bursts import without_bursts
from scm.data_quality.check import check
from scm.data_quality.encoder_counts import repaired_counters
from scm.data_quality.physical_limits import limits_of
from scm.data_quality.problem import DataProblem, Span, folded
from scm.data_quality.quality import Quality
from scm.data_quality.repairs import corrected
from scm.data_quality.row_spacing import called
from scm.data_quality.spikes import without_spikes
from scm.data_quality.stretches import stretches
from scm.data_quality.timestamps import (
    Table,
    count_of,
    in_order,
    in_seconds,
    tables_of,
    with_numbers,
    without_repeats,
    without_strays,
)
from scm.errors import RecordingError
from scm.recording.columns import LeftOut
from scm.recording.read import Recording
from scm.vehicles.car import Car

REPAIRS = ("unit", "sign", "clock", "clipped", "wrapped", "assumed")
UNCHANGED = ("not_finite", "assumed")  # a cell without a number is no row that was changed
MOST_REASONS = 10  # lines of an account; more of them mean the wrong file


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
    """Return a recording with its rows in order, each possible for its car.

    Args:
        recording: As it was read; it is not changed.
        car: Says how fast it can go and turn.
    """
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
