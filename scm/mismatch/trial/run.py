"""A whole trial: cases are made and sealed, diagnosed blind, labels opened and checked, judged."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path

from scm.errors import RecordingError
from scm.mismatch.trial import labels, table
from scm.mismatch.trial.again import Ratio, compare
from scm.mismatch.trial.blind import Answer, Diagnose, answer_all, stored_answers
from scm.mismatch.trial.reality import CaseRequest, make_cases
from scm.mismatch.trial.score import Outcome, failed, score

FOUND = "found"
Notify = Callable[[str, int, int], None]
"""Hears what is being done, how many of it are done, and of how many."""


def silent(_what: str, _done: int, _of: int) -> None:
    """Notify nobody."""


def on_own_cases(
    request: CaseRequest,
    out: Path,
    diagnose: Diagnose,
    *,
    workers: int = 2,
    notify: Notify = silent,
) -> list[str]:
    """Have cases made in `out`, diagnose them blind, and return the table.

    Raises:
        RecordingError: when a label is not what was sealed, or `out` holds cases already.
        RunError: when there is no independent reality here.
    """
    if (out / labels.SEALED).exists():
        msg = f"{out}: holds a trial already; give another --out, or none"
        raise RecordingError(msg)
    notify("making cases", 0, request.cases)
    make_cases(request, out, lambda done: notify("making cases", done, request.cases))
    seals = labels.read_seals(out)
    cases = labels.find_cases(out)
    answers = _answers(cases, out, diagnose, workers, notify)
    opened = {case: labels.open_label(out, case, digest) for case, digest in seals.items()}
    return _judged(answers, opened, out)


def on_shipped_cases(
    folder: Path, out: Path, diagnose: Diagnose, only: Collection[str] = (), *,
    workers: int = 2, notify: Notify = silent,
) -> list[str]:  # fmt: skip
    """Diagnose cases that lie in `folder`, then open its `labels.json`, and return the table.

    Raises:
        RecordingError: when there are no such cases.
    """
    cases = labels.find_cases(folder, only)
    answers = _answers(cases, out, diagnose, workers, notify)
    return _judged(answers, labels.shipped_labels(folder / "labels.json"), out)


def judged_again(out: Path, folder: Path | None = None) -> list[str]:
    """Judge the diagnoses that a trial left in `out` once more, and return the table.

    Args:
        out: Of the trial.
        folder: Of the cases, where they were not made by the trial.

    Raises:
        RecordingError: when there are no such cases, or a label is not what was sealed.
    """
    cases = labels.find_cases(folder or out)
    answers = list(stored_answers(cases, out / FOUND))
    if folder:
        return _judged(answers, labels.shipped_labels(folder / "labels.json"), out)
    seals = labels.read_seals(out)
    opened = {case: labels.open_label(out, case, digest) for case, digest in seals.items()}
    return _judged(answers, opened, out)


def _answers(
    cases: Sequence[labels.Case], out: Path, diagnose: Diagnose, workers: int, notify: Notify
) -> list[Answer]:
    answers: list[Answer] = []
    notify("diagnosing", 0, len(cases))
    for answer in answer_all(cases, out / FOUND, diagnose, workers):
        answers.append(answer)
        notify("diagnosing", len(answers), len(cases))
    return sorted(answers, key=lambda answer: answer.case.name)


def _judged(answers: Iterable[Answer], opened: Mapping[str, labels.Label], out: Path) -> list[str]:
    outcomes: list[Outcome] = []
    ratios: list[Ratio] = []
    for answer in answers:
        label = opened[answer.case.name]
        if answer.diagnosis is None:
            outcomes.append(failed(label, answer.failed))
            continue
        outcomes.append(score(label, answer.diagnosis))
        ratio = compare(answer.case, label, out / FOUND / answer.case.name)
        ratios += [] if ratio is None else [ratio]
    lines = [*table.lines(outcomes, ratios), "", *table.each(outcomes)]
    (out / "table.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return lines
