"""A study's results as text: failures first, then success and measures by factor, then effects."""

from collections import Counter
from collections.abc import Iterator, Sequence

from scm.study import tables
from scm.study.row import Row
from scm.study.tables import StudyResults, Table

MAX_FAILURES, MAX_LEVELS = 10, 24


def text_report(results: StudyResults) -> list[str]:
    """Return the lines for a terminal."""
    rows = [results.rows[number] for number in sorted(results.rows)]
    lines = list(_head(results, rows))
    if not rows:
        return lines
    names, axes = tables.measured(results), tables.varied(results)
    lines += ["", *_failures(results)]
    for axis in axes:
        found = tables.by_factor(rows, axis, names)
        if len(found.lines) > 1:
            lines += ["", *_written(found)]
    for name, unit in names.items():
        for found in tables.crossed(rows, axes, name, unit):
            lines += ["", *_written(found)]
    return [*lines, "", "main effects, averaged over all other factors:", *_written(
        tables.effects(rows, axes, names)
    )]  # fmt: skip


def _head(results: StudyResults, rows: Sequence[Row]) -> Iterator[str]:
    file = results.file
    yield f"{file.name}: {file.study.title or results.about}"
    counts = Counter(tables.outcome_text(results, row) for row in rows)
    words = ", ".join(f"{count} {word}" for word, count in counts.most_common())
    yield f"{len(rows)} of {results.cases} cases: {words or 'none yet'}"


def _failures(results: StudyResults) -> Iterator[str]:
    failures = tables.ordered_failures(results)
    if not failures:
        yield "no failures"
        return
    yield f"failures, the worst first ({min(len(failures), MAX_FAILURES)} of {len(failures)}):"
    for case, outcome, what, factors in tables.failures(results, MAX_FAILURES).lines:
        yield f"  case {case}: {outcome}: {what}; {factors}"
    yield f"  scm study replay {results.folder} {failures[0].case}"


def _written(table: Table) -> Iterator[str]:
    """Yield the lines of a table in columns."""
    every = [table.header, *table.lines[:MAX_LEVELS]]
    widths = [max(len(line[column]) for line in every) for column in range(len(table.header))]
    for line in every:
        cells = [
            text.ljust(width) if column < table.texts else text.rjust(width)
            for column, (text, width) in enumerate(zip(line, widths, strict=True))
        ]
        yield "  ".join(cells).rstrip()
    if len(table.lines) > MAX_LEVELS:
        yield f"... {len(table.lines) - MAX_LEVELS} more"
