"""Runs a study: what is missing, on an engine, until all is there or enough is known."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from scm.errors import RunError
from scm.study.case_process import Task
from scm.study.engine import Engine
from scm.study.results import Results
from scm.study.row import Row
from scm.study.statistics import half_width, is_known
from scm.study.stored import RECORDINGS, recording_name

OnRow = Callable[[Row], None]


@dataclass(frozen=True, slots=True)
class RunEnd:
    """How a run ended.

    Attributes:
        is_complete: Whether nothing is left to run.
        why: For people.
    """

    is_complete: bool
    why: str


def run_study(
    results: Results, engine: Engine, on_row: OnRow, *, fail_fast: bool = False
) -> RunEnd:
    """Run the cases of a study that are not there yet.

    Args:
        results: Where rows go, and which are there.
        engine: Where cases run.
        on_row: Called with each new row.
        fail_fast: End at the first case that does not end by itself.

    Raises:
        RunError: a case failed, and `fail_fast` is set.
    """
    for numbers in _rounds(results):
        if _is_enough(results, numbers.start):
            return _end(results, True, "enough is known")
        tasks = (Task(case=number) for number in numbers if number not in results.rows)
        for row in engine.run(tasks):
            results.add(row)
            on_row(row)
            if fail_fast and not row.has_ended:
                results.write()
                raise RunError(f"case {row.case}: {row.outcome}: {row.detail}")
        results.write()
    _record(results, engine)
    return _end(results, True, "all cases are there")


def missing(results: Results) -> int:
    """Return how many cases are not there yet, unless a stop rule ends the study before."""
    return len(results.study.design) - len(results.rows)


def _rounds(results: Results) -> Iterator[range]:
    """Yield the case numbers to run in one go: all, or replication by replication."""
    design = results.study.design
    if results.study.file.study.stop is None:
        yield range(len(design))
        return
    for first in range(0, len(design), design.points):
        yield range(first, first + design.points)


def _is_enough(results: Results, first: int) -> bool:
    """Return whether the stop rule holds for the replications before case `first`.

    Only whole replications count, so that it does not matter which case ended when.
    """
    rule, design = results.study.file.study.stop, results.study.design
    if rule is None or first // design.points < rule.at_least:
        return False
    rows = [results.rows[number] for number in range(first)]
    return is_known(half_width(rows, rule.measure, design), rule.half_width)


def _record(results: Results, engine: Engine) -> None:
    """Run again, recorded, the cases that are to be recorded: they are the same again."""
    study = results.study.file.study
    if study.recordings == "none":
        return
    if study.recordings == "failures":
        failed = (n for n, row in sorted(results.rows.items()) if row.outcome == "failure")
        wanted = list(failed)[: study.max_recordings]
    else:
        wanted = [number for number in study.recordings if number in results.rows]
    folder = (results.folder / RECORDINGS).resolve()
    folder.mkdir(exist_ok=True)
    paths = {number: folder / recording_name(number) for number in wanted}
    tasks = [
        Task(case=number, record_to=str(path))
        for number, path in paths.items()
        if not path.exists()
    ]
    for _ in engine.run(tasks):
        pass


def _end(results: Results, is_complete: bool, why: str) -> RunEnd:
    results.finish(state="complete", why=why)
    return RunEnd(is_complete, why)
