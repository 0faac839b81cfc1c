"""A study's results as one HTML file that loads nothing."""

from collections import Counter
from collections.abc import Iterator, Sequence

from scm.mismatch.report.page import around, document, section, table, tag
from scm.study import tables
from scm.study.plots import plots_of
from scm.study.row import Row
from scm.study.statistics import wilson
from scm.study.stored import read_manifest, recording_of
from scm.study.tables import StudyResults, Table

MAX_FAILURES, MAX_LEVELS = 10, 60
EFFECTS = (
    "Means over all other factors. `explains` is the share of the measure's variance that the "
    "factor alone explains, `p` the probability of so large a share by chance."
)


def study_page(results: StudyResults) -> str:
    """Return the page."""
    rows = [results.rows[number] for number in sorted(results.rows)]
    body = _head(results, rows)
    if rows:
        body += "".join(_sections(results, rows))
    return document(f"{results.file.name}: a study", body)


def _head(results: StudyResults, rows: Sequence[Row]) -> str:
    file, manifest = results.file, read_manifest(results.folder)
    counts = Counter(tables.outcome_text(results, row) for row in rows)
    words = [f"{count} {word}" for word, count in counts.most_common()]
    text = f"{len(rows)} of {results.cases} cases: {', '.join(words) or 'none yet'}"
    if tables.has_limits(file.measures) and rows:
        share = wilson(counts["success"], len(rows))
        text += f"; success {tables.interval_text(share, '%')} %"
    made = f"scm {manifest.get('scm', '')} {str(manifest.get('git', ''))[:12]}"
    where = f"study {file.name}, scenario {file.study.scenario}, {made}"
    inner = tag("p", where, "inputs")
    inner += tag("h1", file.study.title or results.about) + tag("p", text)
    kind = "none" if all(row.has_ended for row in rows) else "unable"
    return around("header", around("div", inner, "words"), f"verdict {kind}")


def _sections(results: StudyResults, rows: Sequence[Row]) -> Iterator[str]:
    names, axes = tables.measured(results), tables.varied(results)
    if tables.ordered_failures(results):
        yield section("failures", "Failures, the worst first", _failures(results))
    for name, unit in names.items():
        measure = results.file.measures.get(name)
        about = tag("p", measure.about) if measure and measure.about else ""
        figures = "".join(
            around(
                "figure",
                tag("h3", plot.title)
                + around("div", plot.svg, "canvas")
                + tag("figcaption", plot.caption),
            )
            for plot in plots_of(rows, axes, name, unit)
        )
        both = "".join(map(_table, tables.crossed(rows, axes, name, unit)))
        yield section(name, f"{name} [{unit}]", about, around("div", figures, "grid"), both)
    levels = (tables.by_factor(rows, axis, names) for axis in axes)
    yield section("factors", "By factor", *(_table(one) for one in levels if len(one.lines) > 1))
    effects = _table(tables.effects(rows, axes, names))
    yield section("effects", "Main effects", tag("p", EFFECTS), effects)
    text = around("div", around("pre", tag("code", results.file.text)), "scroll")
    yield section("file", "The study file", text)


def _failures(results: StudyResults) -> str:
    failures = tables.ordered_failures(results)
    found = tables.failures(results, MAX_FAILURES)
    recordings = (recording_of(results.folder, int(line[0])) for line in found.lines)
    lines = [
        [*line, path.name if path else ""]
        for line, path in zip(found.lines, recordings, strict=True)
    ]
    first = f"`scm study replay {results.folder} {failures[0].case}` shows the first one live."
    more = len(failures) - len(lines)
    text = tag("p", f"{more} more are in cases.parquet.") if more > 0 else ""
    return tag("p", first) + _table(Table([*found.header, "recording"], lines, 5)) + text


def _table(found: Table) -> str:
    """Return a table as HTML."""
    numbers = range(found.texts, len(found.header))
    return table(found.header, found.lines[:MAX_LEVELS], numbers)
