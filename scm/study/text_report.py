"""A study's results as text: failures first, then success and measures by factor, then effects."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from scm.study.results import Results
from scm.study.row import Row
from scm.study.statistics import (
    SUCCESS,
    Interval,
    by_level,
    estimate,
    level_text,
    main_effects,
)
from scm.study.study_file import Measure
from scm.study.targets import Axis

MAX_FAILURES, MAX_LEVELS = 10, 24


def text_report(results: Results) -> list[str]:
    """Return the lines of a terminal."""
    rows = [results.rows[number] for number in sorted(results.rows)]
    lines = list(_head(results, rows))
    if not rows:
        return lines
    lines += ["", *_failures(results, rows)]
    names = measured(results)
    for axis in varied(results):
        groups = by_level(rows, axis)
        if len(groups) > 1:
            lines += ["", *_by_factor(axis.path, groups, names)]
    lines += ["", *_effects(results, rows, names)]
    return lines


def measured(results: Results) -> dict[str, str]:
    """Return what is reported by name, with its unit: success if there are limits, and measures."""
    measures = results.study.file.measures
    names = {SUCCESS: "%"} if has_limits(measures) else {}
    return names | {name: measure.unit for name, measure in measures.items()}


def has_limits(measures: Mapping[str, Measure]) -> bool:
    """Return whether any measure has a limit: otherwise every case that ends is a success."""
    return any(one.at_least is not None or one.at_most is not None for one in measures.values())


def varied(results: Results) -> list[Axis]:
    """Return the factors that have more than one value."""
    axes = results.study.design.axes
    return [axis for axis in axes if axis.factor.is_drawn or len(axis.factor.levels) > 1]


def interval_text(found: Interval, unit: str) -> str:
    """Return an estimate with its interval: `61.2 [58.0, 64.4]`."""
    if not math.isfinite(found.value):
        return "-"
    scale = 100.0 if unit == "%" else 1.0
    value, low, high = (scale * number for number in found[:3])
    if not math.isfinite(low):
        return f"{value:.4g}"
    digits = decimals_of(high - low)
    return f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def decimals_of(width: float) -> int:
    """Return with how many decimals an interval of a width is written."""
    if width <= 0.0 or not math.isfinite(width):
        return 3
    return max(0, min(6, 1 - math.floor(math.log10(width))))


def ordered_failures(results: Results, rows: Sequence[Row]) -> list[Row]:
    """Return cases that did not end, then failures, the worst first."""
    measures = results.study.file.measures

    def excess(row: Row) -> float:
        """Return by how much of its limit a row is beyond it, at the worst measure."""
        worst = 0.0
        for name, limits in measures.items():
            value = row.measures.get(name, math.nan)
            if math.isnan(value):
                continue
            for limit, beyond in ((limits.at_most, 1.0), (limits.at_least, -1.0)):
                if limit is not None:
                    worst = max(worst, beyond * (value - limit) / (abs(limit) or 1.0))
        return worst

    ended = [row for row in rows if row.outcome == "failure"]
    return [
        *(row for row in rows if not row.has_ended),
        *sorted(ended, key=excess, reverse=True),
    ]


def table(header: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    """Return a table of text; the first column is left, the others right."""
    every = [header, *body]
    widths = [max(len(line[column]) for line in every) for column in range(len(header))]
    lines = []
    for line in every:
        cells = [line[0].ljust(widths[0])]
        cells += [text.rjust(width) for text, width in zip(line[1:], widths[1:], strict=True)]
        lines.append("  ".join(cells).rstrip())
    return lines


def values_text(row: Row, axes: Sequence[Axis]) -> str:
    """Return a case's factors in words."""
    return ", ".join(f"{axis.path} = {level_text(row.values[axis.path])}" for axis in axes)


def _head(results: Results, rows: Sequence[Row]) -> Iterator[str]:
    study = results.study
    yield f"{study.file.name}: {study.file.study.title or study.scenario.about}"
    counts = Counter(row.outcome for row in rows)
    outcomes = ", ".join(
        f"{count} {name.replace('_', ' ')}" for name, count in counts.most_common()
    )
    yield f"{len(rows)} of {len(study.design)} cases: {outcomes or 'none yet'}"


def _failures(results: Results, rows: Sequence[Row]) -> Iterator[str]:
    failures = ordered_failures(results, rows)
    if not failures:
        yield "no failures"
        return
    yield f"failures, the worst first ({min(len(failures), MAX_FAILURES)} of {len(failures)}):"
    for row in failures[:MAX_FAILURES]:
        measures = results.study.file.measures
        what = row.detail or ", ".join(
            f"{name} {row.measures[name]:.4g} {measures[name].unit}" for name in row.measures
        )
        yield f"  case {row.case}: {row.outcome}: {what}; {values_text(row, varied(results))}"
    yield f"  scm study replay {results.folder} {failures[0].case}"


def _by_factor(
    path: str, groups: Mapping[str, Sequence[Row]], names: Mapping[str, str]
) -> Iterator[str]:
    header = [path, "cases", *(f"{name} [{unit}]" for name, unit in names.items())]
    body = [
        [
            level, str(len(group)),
            *(interval_text(estimate(group, name), unit) for name, unit in names.items()),
        ]
        for level, group in groups.items()
    ]  # fmt: skip
    yield from table(header, body[:MAX_LEVELS])
    if len(body) > MAX_LEVELS:
        yield f"... {len(body) - MAX_LEVELS} more"


def _effects(results: Results, rows: Sequence[Row], names: Mapping[str, str]) -> Iterator[str]:
    header = ["main effects", "measure", "lowest", "at", "highest", "at", "explains", "p"]
    body = []
    for name, unit in names.items():
        scale = 100.0 if unit == "%" else 1.0
        for effect in main_effects(rows, varied(results), name):
            p = (
                "-"
                if math.isnan(effect.p)
                else ("< 0.001" if effect.p < 1e-3 else f"{effect.p:.3f}")
            )
            body.append(
                [
                    effect.factor, f"{name} [{unit}]", f"{scale * effect.lowest:.4g}",
                    effect.at_lowest, f"{scale * effect.highest:.4g}", effect.at_highest,
                    f"{effect.share:.0%}", p,
                ]
            )  # fmt: skip
    if body:
        yield from table(header, body)
