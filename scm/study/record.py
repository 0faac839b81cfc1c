"""A study as records: its row in a list, which is cheap to read, and what came of it."""

import math
import os
import platform
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from functools import lru_cache
from pathlib import Path

import msgspec
import pyarrow.parquet as pq

from scm.clock import NS_PER_S, WallClock
from scm.errors import StudyError, reading
from scm.records.studies import (
    Estimate,
    FactorLevel,
    FactorTable,
    Outcomes,
    Study,
    StudyCase,
    StudyFactor,
    StudyMeasure,
    StudyRow,
    StudyState,
)
from scm.study import tables
from scm.study.row import Row
from scm.study.statistics import Interval, by_level, estimate, wilson
from scm.study.stored import (
    CASES,
    MANIFEST,
    PARTS,
    Manifest,
    StoredResults,
    parts_of,
    read_description,
    recording_of,
)
from scm.study.study_file import DISTRIBUTIONS
from scm.study.targets import Axis

MAX_LEVELS, MAX_WORST = 200, 50
START_S = 300.0  # a first start compiles physics
MAX_PARTS = 50_000  # that are counted once: a part is a second of work
KINDS = ("values", "grid", *DISTRIBUTIONS)


def study_row(folder: Path) -> StudyRow:
    """Return the row of a study, without reading more of its cases than their outcomes.

    Raises:
        StudyError: when it cannot be read.
    """
    manifest, file = read_description(folder)
    counts = _outcomes_of(folder)
    done = counts.total()
    is_judged = done > 0 and tables.has_limits(file.measures)
    with reading(folder / MANIFEST, "a study's manifest", StudyError):
        began_ns, ended_ns = _epoch_ns(manifest.began), _epoch_ns(manifest.ended)
    return StudyRow(
        name=folder.name,
        title=file.study.title or manifest.about,
        scenario=file.study.scenario,
        state=_state(folder, manifest, file.study.time_limit_s),
        cases=manifest.cases,
        done=done,
        outcomes=msgspec.convert(dict(counts), Outcomes),
        success=_estimate(wilson(counts["success"], done)) if is_judged else None,
        began_ns=began_ns,
        ended_ns=ended_ns,
    )


def study_record(results: StoredResults) -> Study:
    """Return all that is shown of a study.

    Raises:
        StudyError: when it cannot be read.
    """
    rows = [results.rows[number] for number in sorted(results.rows)]
    names = list(tables.measured(results))
    return Study(
        row=study_row(results.folder),
        factors=tuple(map(_factor, results.axes)),
        measures=tuple(
            StudyMeasure(
                name=name,
                unit=measure.unit,
                about=measure.about,
                at_least=measure.at_least,
                at_most=measure.at_most,
            )
            for name, measure in results.file.measures.items()
        ),
        tables=tuple(_table(rows, axis, names) for axis in tables.varied(results)),
        worst=tuple(
            _case(results.folder, row) for row in tables.ordered_failures(results)[:MAX_WORST]
        ),
    )


def _outcomes_of(folder: Path) -> Counter[str]:
    """Return how many cases have which outcome."""
    whole = folder / CASES
    paths = [whole] if whole.is_file() else parts_of(folder)
    try:
        dated = [(path, path.stat().st_mtime_ns) for path in paths]
    except FileNotFoundError:  # it has just become complete
        dated = [(whole, whole.stat().st_mtime_ns)]
    found = Counter[str]()
    for path, written_ns in dated:
        found.update(_outcomes_in(path, written_ns))
    return found


@lru_cache(MAX_PARTS)
def _outcomes_in(path: Path, _written_ns: int) -> dict[str, int]:
    with reading(path, "rows of a study", StudyError), pq.ParquetFile(path) as file:
        counts = file.read(columns=["outcome"])["outcome"].value_counts()
        return {entry["values"]: entry["counts"] for entry in counts.to_pylist()}


def _state(folder: Path, manifest: Manifest, time_limit_s: float) -> StudyState:
    """Return whether a study runs: its process lives, and no case takes longer than it may."""
    if manifest.state == "complete":
        return "complete"
    if manifest.host == platform.node() and not _is_alive(manifest.pid):
        return "stopped"
    paths = (path for path in (folder / MANIFEST, folder / PARTS) if path.exists())
    written_ns = max(path.stat().st_mtime_ns for path in paths)
    quiet_s = (WallClock().now_ns() - written_ns) / NS_PER_S
    return "running" if quiet_s < time_limit_s + START_S else "stopped"


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return pid > 0


def _epoch_ns(text: str) -> int | None:
    """Return a time of the manifest in nanoseconds since 1970; None: there is none."""
    return round(datetime.fromisoformat(text).timestamp()) * NS_PER_S if text else None


def _factor(axis: Axis) -> StudyFactor:
    factor = axis.factor
    kind = next(kind for kind in KINDS if getattr(factor, kind) is not None)
    values = getattr(factor, kind)
    return StudyFactor(
        path=axis.path,
        kind=kind,
        values=values if isinstance(values, tuple) else (values,),
        apply=factor.apply,
    )


def _table(rows: Sequence[Row], axis: Axis, names: Sequence[str]) -> FactorTable:
    groups = list(by_level(rows, axis).items())[:MAX_LEVELS]
    levels = (
        FactorLevel(
            level=level,
            cases=len(group),
            estimates={name: _estimate(estimate(group, name)) for name in names},
        )
        for level, group in groups
    )
    return FactorTable(factor=axis.path, levels=tuple(levels))


def _estimate(found: Interval) -> Estimate:
    value, low, high = (one if math.isfinite(one) else None for one in found[:3])
    return Estimate(value=value, low=low, high=high, cases=found.cases)


def _case(folder: Path, row: Row) -> StudyCase:
    return StudyCase(
        case=row.case,
        seed=row.seed,
        outcome=row.outcome,
        detail=row.detail,
        seconds=row.seconds,
        factors=dict(row.values),
        measures=dict(row.measures),
        recorded=recording_of(folder, row.case) is not None,
    )
