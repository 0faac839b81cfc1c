"""A recording as tools compare it with a car: screened row by row, cut at gaps, repaired."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scm.data_quality.check import check
from scm.data_quality.corrected import corrected
from scm.data_quality.problem import DataProblem, folded
from scm.data_quality.rows import called
from scm.data_quality.screen import screen
from scm.data_quality.stamps import Table, count_of, tables_of
from scm.data_quality.stretches import stretches
from scm.data_quality.suspicion import Quality
from scm.errors import RecordingError
from scm.recording.columns import LeftOut
from scm.recording.read import Recording
from scm.vehicles.car import Car

REPAIRS = ("unit", "sign", "clock", "clipped", "wrapped", "assumed")
UNCHANGED = ("not_finite", "assumed")  # a cell without a number is no row that was changed
MOST_LISTED = 10  # reasons: whoever reads more has the wrong file


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
    for (file, why), some in list(alike.items())[:MOST_LISTED]:
        first = ", ".join(str(one.line) for one in some[:3])
        more = f" and {len(some) - 3} more" if len(some) > 3 else ""
        lines.append(f"{file}: lines {first}{more}: {why}" if len(some) > 1 else str(some[0]))
    rest = sum(map(len, list(alike.values())[MOST_LISTED:]))
    return (*lines, f"and {rest} more lines that are no rows") if rest else tuple(lines)
