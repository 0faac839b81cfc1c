"""A study's results as tables of texts, for the terminal and the page alike."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from scm.study.row import Row
from scm.study.statistics import (
    SUCCESS,
    Interval,
    by_level,
    estimate,
    level_text,
    main_effects,
)
from scm.study.study_file import Measure, StudyFile
from scm.study.targets import Axis

MAX_ACROSS = 6
MAX_DECIMALS = 4  # a step of a simulation shows no finer


class StudyResults(Protocol):
    """Results of a study, stored ones or those of a run; `StoredResults` says what is what."""

    @property
    def folder(self) -> Path: ...  # noqa: D102
    @property
    def file(self) -> StudyFile: ...  # noqa: D102
    @property
    def axes(self) -> Sequence[Axis]: ...  # noqa: D102
    @property
    def cases(self) -> int: ...  # noqa: D102
    @property
    def about(self) -> str: ...  # noqa: D102
    @property
    def rows(self) -> Mapping[int, Row]: ...  # noqa: D102


class Table(NamedTuple):
    """A header and lines; the first `texts` columns are words, the others numbers."""

    header: list[str]
    lines: list[list[str]]
    texts: int = 1


def measured(results: StudyResults) -> dict[str, str]:
    """Return what is reported by name, with its unit: success if there are limits, and measures."""
    measures = results.file.measures
    names = {SUCCESS: "%"} if has_limits(measures) else {}
    return names | {name: measure.unit for name, measure in measures.items()}


def has_limits(measures: Mapping[str, Measure]) -> bool:
    """Return whether any measure has a limit: otherwise every case that ends is a success."""
    return any(one.at_least is not None or one.at_most is not None for one in measures.values())


def varied(results: StudyResults) -> list[Axis]:
    """Return the factors that have more than one value."""
    return [axis for axis in results.axes if axis.factor.is_drawn or len(axis.factor.levels) > 1]


def outcome_text(results: StudyResults, row: Row) -> str:
    """Return an outcome in words; without limits there is nothing to succeed in."""
    is_judged = has_limits(results.file.measures) or not row.has_ended
    return row.outcome.replace("_", " ") if is_judged else "ended"


def values_text(row: Row, axes: Sequence[Axis]) -> str:
    """Return a case's factors in words."""
    return ", ".join(f"{axis.path} = {level_text(row.values[axis.path])}" for axis in axes)


def interval_text(found: Interval, unit: str) -> str:
    """Return an estimate with its interval: `61.2 [58.0, 64.4]`."""
    if not math.isfinite(found.value):
        return "-"
    scale = 100.0 if unit == "%" else 1.0
    value, low, high = (scale * number for number in found[:3])
    if not math.isfinite(low):
        return f"{value:.4g}"
    digits = _decimals_of(high - low)
    return f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def _decimals_of(width: float) -> int:
    """Return with how many decimals an interval of a width is written."""
    if width <= 0.0 or not math.isfinite(width):
        return MAX_DECIMALS
    return max(0, min(MAX_DECIMALS, 1 - math.floor(math.log10(width))))


def failures(results: StudyResults, most: int) -> Table:
    """Return the cases that did not end, then failures, the worst first."""
    measures, axes = results.file.measures, varied(results)
    lines = []
    for row in ordered_failures(results)[:most]:
        what = row.detail or ", ".join(
            f"{name} {value:.4g} {measures[name].unit}" for name, value in row.measures.items()
        )
        lines.append([str(row.case), outcome_text(results, row), what, values_text(row, axes)])
    return Table(["case", "outcome", "what", "factors"], lines, 4)


def ordered_failures(results: StudyResults) -> list[Row]:
    """Return the cases that did not end, then failures, the worst first."""
    measures = results.file.measures
    rows = [results.rows[number] for number in sorted(results.rows)]
    failed = [row for row in rows if row.outcome == "failure"]
    failed.sort(key=lambda row: _excess(row, measures), reverse=True)
    return [*(row for row in rows if not row.has_ended), *failed]


def _excess(row: Row, measures: Mapping[str, Measure]) -> float:
    """Return by how much of its limit a case is beyond it, at the worst measure."""
    worst = 0.0
    for name, limits in measures.items():
        value = row.measures.get(name, math.nan)
        for limit, beyond in ((limits.at_most, 1.0), (limits.at_least, -1.0)):
            if limit is not None and not math.isnan(value):
                worst = max(worst, beyond * (value - limit) / (abs(limit) or 1.0))
    return worst


def by_factor(rows: Sequence[Row], axis: Axis, names: Mapping[str, str]) -> Table:
    """Return all measures by the level of a factor."""
    header = [axis.path, "cases", *(f"{name} [{unit}]" for name, unit in names.items())]
    lines = [
        [
            level,
            str(len(group)),
            *(interval_text(estimate(group, name), unit) for name, unit in names.items()),
        ]
        for level, group in by_level(rows, axis).items()
    ]
    return Table(header, lines)


def crossed(rows: Sequence[Row], axes: Sequence[Axis], measure: str, unit: str) -> Iterator[Table]:
    """Yield a measure's table over two factors, if there are just two of few values."""
    few = [axis for axis in axes if not axis.factor.is_drawn]
    if len(few) != 2 or len(axes) != 2:
        return
    across, down = sorted(few, key=lambda axis: len(axis.factor.levels))
    if len(across.factor.levels) > MAX_ACROSS:
        return
    columns = [level_text(level) for level in across.factor.levels]
    lines = []
    for level, group in by_level(rows, down).items():
        cells = by_level(group, across)
        found = (estimate(cells.get(column, []), measure) for column in columns)
        lines.append([level, *(interval_text(one, unit) for one in found)])
    yield Table([f"{measure} [{unit}] by {down.path}", *columns], lines)


def effects(rows: Sequence[Row], axes: Sequence[Axis], names: Mapping[str, str]) -> Table:
    """Return how each factor moves each measure, averaged over all others, the strongest first."""
    lines = []
    for name, unit in names.items():
        scale = 100.0 if unit == "%" else 1.0
        for found in main_effects(rows, axes, name):
            p = "-" if math.isnan(found.p) else f"{found.p:.3f}"
            lines.append(
                [
                    found.factor,
                    f"{name} [{unit}]",
                    f"{scale * found.lowest:.4g} at {found.at_lowest}",
                    f"{scale * found.highest:.4g} at {found.at_highest}",
                    f"{found.share:.0%}",
                    "< 0.001" if found.p < 1e-3 else p,
                ]
            )
    return Table(["factor", "measure", "lowest", "highest", "explains", "p"], lines, 2)
