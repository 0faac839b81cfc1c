"""Diagnoses cases in worker processes that are given recordings and nothing of the labels."""

import multiprocessing
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import msgspec

from scm.mismatch.findings import Diagnosis
from scm.mismatch.pipeline import diagnose, write
from scm.mismatch.trial.labels import Case
from scm.runtime.parent_watch import end_with

DIAGNOSIS, BROKEN = "diagnosis.json", "failed.txt"
Diagnose = Callable[[Path, Path], Diagnosis]
"""Diagnoses the recording of one folder; may write what it found, and `car.toml`, in another."""


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to one case; either a diagnosis, or why there is none."""

    case: Case
    diagnosis: Diagnosis | None
    failed: str = ""


def answer_all(
    cases: Sequence[Case], out: Path, diagnose: Diagnose, workers: int = 2
) -> Iterator[Answer]:
    """Diagnose cases and give each answer as it comes; each is also written, `diagnosis.json`.

    Args:
        cases: To diagnose.
        out: Gets a folder a case.
        diagnose: A function of a module, so that other processes can load it.
        workers: Processes; 0 diagnoses here, one after another.
    """
    if workers == 0:
        for case in cases:
            yield _answer(case, out, diagnose)
        return
    context = multiprocessing.get_context("spawn")
    leashes, hand = context.Pipe(duplex=False)
    # The hand opens before the pool waits for its work: a trial broken off waits for nobody.
    with (
        ProcessPoolExecutor(workers, context, initializer=end_with, initargs=(leashes,)) as pool,
        hand,
    ):
        waiting: list[Future[Answer]] = [pool.submit(_answer, c, out, diagnose) for c in cases]
        for done in as_completed(waiting):
            yield done.result()


def _answer(case: Case, out: Path, diagnose: Diagnose) -> Answer:
    folder = out / case.name
    folder.mkdir(parents=True, exist_ok=True)
    try:
        diagnosis = diagnose(case.drive, folder)
    except Exception as error:  # noqa: BLE001  the edge of a worker: one case must not end all
        words = "".join(traceback.format_exception(error))
        (folder / BROKEN).write_text(words, encoding="utf-8")
        return Answer(case, None, f"{type(error).__name__}: {error}")
    (folder / DIAGNOSIS).write_bytes(msgspec.json.format(msgspec.json.encode(diagnosis)))
    return Answer(case, diagnosis)


def stored_answers(cases: Sequence[Case], out: Path) -> Iterator[Answer]:
    """Give the answers that an earlier run left in `out`, of the cases that it came to."""
    for case in cases:
        found, broken = out / case.name / DIAGNOSIS, out / case.name / BROKEN
        if found.is_file():
            yield Answer(case, msgspec.json.decode(found.read_bytes(), type=Diagnosis))
        elif broken.is_file():
            yield Answer(case, None, broken.read_text(encoding="utf-8").strip().split("\n")[-1])


def by_engine(recording: Path, out: Path) -> Diagnosis:
    """Diagnose with the project's own engine."""
    found = diagnose([recording])
    write(found, out)
    return found.diagnosis
