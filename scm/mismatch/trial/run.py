"""A whole trial: cases are made and sealed, diagnosed blind, labels opened and checked, judged.

The independent reality, a program of its own beside this package, makes the cases. Worker
processes diagnose them; they receive recordings and nothing of the labels.
"""

import multiprocessing
import subprocess
import sys
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec

import scm
from scm.errors import RecordingError, RunError
from scm.mismatch.findings import Diagnosis
from scm.mismatch.pipeline import diagnose, write
from scm.mismatch.trial import labels
from scm.mismatch.trial.again import Ratio, compare
from scm.mismatch.trial.labels import Case
from scm.mismatch.trial.score import Outcome, each, failed, lines, score
from scm.runtime.parent_watch import end_with, with_parent

FOUND = "found"
Notify = Callable[[str, int, int], None]
"""Receives what is being done, how many of it are done, and of how many."""
PLACE = "tests/reality"
KINDS = (
    "mixed", "single", "none", "pair", "unlisted", "dependent", "placed", "step", "ramp",
    "intermittent", "shuffled", "other_car",
)  # fmt: skip
ENGINES = ("own", "mujoco", "commonroad", "pybullet")
FAMILIES, HALVES = ("own", "drawn"), ("develop", "judge")
DIAGNOSIS, BROKEN = "diagnosis.json", "failed.txt"
Diagnose = Callable[[Path, Path], Diagnosis]
"""Diagnoses the recording of one folder; may write what it found, and `car.toml`, in another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseRequest:
    """What cases to make.

    Attributes:
        strength: Smallest and largest, in multiples of what a drive can show at all.
        family: Whether equations and sensors are the usual ones, or drawn with each case.
        half: Of the values they are drawn from; None: all.
    """

    seed: int = 0
    cases: int = 40
    kind: str = "mixed"
    engine: str = "own"
    strength: tuple[float, float] = (1.0, 4.0)
    family: str = "own"
    half: str | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer to one case; either a diagnosis, or why there is none."""

    case: Case
    diagnosis: Diagnosis | None
    failed: str = ""


def silent(_what: str, _done: int, _of: int) -> None:
    """Notify nobody."""


def on_own_cases(
    request: CaseRequest,
    out: Path,
    diagnose: Diagnose,
    *,
    executor: Executor | None = None,
    notify: Notify = silent,
) -> list[str]:
    """Have cases made in `out`, diagnose them blind, and return the table.

    Arguments are those of `answer_all`.

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
    answers = _answers(cases, out, diagnose, executor, notify)
    opened = {case: labels.open_label(out, case, digest) for case, digest in seals.items()}
    return _judged(answers, opened, out)


def on_shipped_cases(
    folder: Path, out: Path, diagnose: Diagnose, only: Collection[str] = (), *,
    executor: Executor | None = None, notify: Notify = silent,
) -> list[str]:  # fmt: skip
    """Diagnose cases that lie in `folder`, then open its `labels.json`, and return the table.

    Arguments are those of `answer_all`.

    Raises:
        RecordingError: when there are no such cases.
    """
    cases = labels.find_cases(folder, only)
    answers = _answers(cases, out, diagnose, executor, notify)
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
    cases: Sequence[labels.Case],
    out: Path,
    diagnose: Diagnose,
    executor: Executor | None,
    notify: Notify,
) -> list[Answer]:
    answers: list[Answer] = []
    notify("diagnosing", 0, len(cases))
    for answer in answer_all(cases, out / FOUND, diagnose, executor):
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
    rows = [*lines(outcomes, ratios), "", *each(outcomes)]
    (out / "table.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return rows


def find_root() -> Path:
    """Return the folder that holds this package and the independent reality.

    Raises:
        RunError: where there is none, as in an installed wheel.
    """
    root = Path(scm.__file__).resolve().parent.parent
    if not (root / PLACE / "__main__.py").is_file():
        msg = (
            f"{root / PLACE}: not here. Blind trials need the independent reality, which comes "
            f"with the repository and not with the installed package: run them from a clone, "
            f"or score recordings that you have with --trials DIR"
        )
        raise RunError(msg)
    return root


def make_cases(request: CaseRequest, out: Path, notify: Callable[[int], None]) -> None:
    """Write recordings, labels and seals into `out`; `notify` receives how many cases are made.

    Raises:
        RunError: with the reality's own words when it fails.
    """
    command = [
        sys.executable, "-m", PLACE.replace("/", "."), "--out", str(out.absolute()),
        "--seed", str(request.seed), "--cases", str(request.cases), "--kind", request.kind,
        "--engine", request.engine, "--strength", *map(str, request.strength),
        "--family", request.family, *(["--half", request.half] if request.half else []),
    ]  # fmt: skip
    with subprocess.Popen(
        with_parent(command),
        cwd=find_root(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        if running.stdout is None or running.stderr is None:
            return
        for line in running.stdout:
            if line[:1].isdigit():  # engines of other people say things, too
                notify(int(line.split()[0]))
        words = running.stderr.read()
    if running.returncode:
        last = words.strip().splitlines()[-1:] or ["no words"]
        msg = f"the independent reality stopped with {running.returncode}: {last[0]}"
        raise RunError(msg)


def answer_all(
    cases: Sequence[Case], out: Path, diagnose: Diagnose, executor: Executor | None = None
) -> Iterator[Answer]:
    """Diagnose cases and give each answer as it comes; each is also written, `diagnosis.json`.

    Args:
        cases: To diagnose.
        out: Gets a folder a case.
        diagnose: A function of a module, so that other processes can load it.
        executor: What runs a task a case, such as `processes`; None: here, one after another. Its
            processes see the folders of cases and answers.
    """
    if executor is None:
        for case in cases:
            yield _answer(case, out, diagnose)
        return
    waiting: list[Future[Answer]] = [executor.submit(_answer, c, out, diagnose) for c in cases]
    for done in as_completed(waiting):
        yield done.result()


@contextmanager
def processes(workers: int) -> Iterator[Executor | None]:
    """Use so many processes of this machine; 0: none, see `answer_all`."""
    if workers == 0:
        yield None
        return
    context = multiprocessing.get_context("spawn")
    leashes, hand = context.Pipe(duplex=False)
    # The hand opens before the pool waits for its work: a trial broken off waits for nobody.
    with (
        ProcessPoolExecutor(workers, context, initializer=end_with, initargs=(leashes,)) as pool,
        hand,
    ):
        yield pool


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
