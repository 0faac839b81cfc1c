"""What a change is, by a mismatch search; and which of two car files follows new driving better.

Both run in a worker process that takes the processor time which the city leaves over.
"""

import multiprocessing
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from msgspec import structs

from scm.clock import ProcessorClock
from scm.data_quality.prepare import prepare
from scm.errors import RecordingError, ScmError
from scm.mismatch.budget import Budget
from scm.mismatch.findings import Course, Diagnosis, Effect, PartErrors
from scm.mismatch.fit.data_split import Part, Parts
from scm.mismatch.pipeline import diagnose_car
from scm.mismatch.pipeline import write as write_result
from scm.mismatch.report.car_file import FILE, write_own_terms
from scm.mismatch.validate.free_runs import got_worse, judge, nothing_got_worse
from scm.recording.read import Recording
from scm.records.twins import TwinEffect, TwinError, TwinParameter
from scm.replay.drive import Drive
from scm.runtime.parent_watch import Leash, end_with
from scm.runtime.priority import stand_back
from scm.twin.abilities import compared_abilities
from scm.twin.memory import write
from scm.vehicles.car import load_car

FAILURES = (ScmError, OSError, BrokenExecutor)
"""Of searches and comparisons, which never end the part."""
HORIZON_S = 3.0
EARLIER_S, LATER_S = 60.0, 20.0  # that a change began than it was noticed to; a lag shows at stops
BETTER = 0.95  # of an error: what a new version has to reach in one at least
RECORDING = "recording"
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Explained:
    """What a search found of a change.

    Attributes:
        effects: That changed then, the likeliest first.
        between, drive_this: Effects that it cannot tell apart, and the drive that would.
        text: In one or two sentences.
        since_s: When they changed, with the 90 % interval, on the recording's clock; None: the
            search does not say.
        car_file: Of the car as it is now; None: nothing was found that holds.
        abilities: What it can do, and could before.
    """

    effects: tuple[TwinEffect, ...]
    between: tuple[str, ...]
    drive_this: str
    text: str
    since_s: tuple[float, float, float] | None
    car_file: Path | None
    abilities: tuple[TwinParameter, ...] = ()


CUT = " The search ended before everything was examined."


@dataclass(frozen=True, slots=True)
class Compared:
    """Errors of free runs by two car files on the same driving.

    Attributes:
        windows: Of `HORIZON_S`.
        errors: At their end.
        better: Names of what the new one predicts better, beyond what noise may do.
        worse: Of what it predicts worse.
    """

    windows: int
    errors: tuple[TwinError, ...]
    better: tuple[str, ...]
    worse: tuple[str, ...]


class AtOnce(Executor):
    """Runs everything at once in the caller's process: for lockstep, where runs are repeated."""

    def submit(self, function: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run a function; its result is there when this returns."""
        future = Future[T]()
        try:
            future.set_result(function(*args, **kwargs))
        except ScmError as error:
            future.set_exception(error)
        return future


class Worker(Executor):
    """One process that goes after the city's, started when it is needed, and again if it is killed.

    It ends with the process that has it.
    """

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None
        self._pipe: Connection | None = None  # the worker ends when it is closed

    def submit(self, function: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run a function in the worker, after those before it."""
        try:
            return self._running().submit(function, *args, **kwargs)
        except BrokenExecutor:  # it was killed: for its memory, say
            self._pool = None
            return self._running().submit(function, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the worker, whatever it does."""
        if self._pool is not None and self._pipe is not None:
            self._pipe.close()
            self._pool.shutdown(wait, cancel_futures=cancel_futures)

    def _running(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            leash, self._pipe = context.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(1, context, initializer=_begin, initargs=(leash,))
        return self._pool


def _begin(leash: Leash) -> None:
    os.setsid()  # in the twin part's session it would be nice to that part alone
    stand_back(os.getpid())
    end_with(leash)


def explain(
    recording: Recording, car_file: str, out: Path, made: Path, onset_s: tuple[float, float],
    budget_s: float,
) -> Explained:  # fmt: skip
    """Search for what a change is, and write the report of the search.

    Args:
        recording: From before the change until after it.
        car_file: In force, by name or path.
        out: Folder of the report; the recording is written into it.
        made: Car file to be written, if one is found.
        onset_s: Between which moments the change was noticed to begin, on the recording's clock.
        budget_s: For the search, of processor time: on a busy computer it takes longer, and finds
            the same.

    Raises:
        ScmError: when the recording or the car file cannot be used, or nothing can be written.
    """
    budget = Budget(budget_s, ProcessorClock())
    write(recording, out / RECORDING)
    car = load_car(car_file)
    found = diagnose_car([recording], car, budget=budget)
    write_result(found, out)
    effects = [one for one in found.diagnosis.effects if _is_of(one, onset_s)]
    is_found = bool(effects) and found.found_car is not None and found.found_car is not found.car
    if is_found and found.found_car is not None:
        made.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(out / FILE, made)  # reports may be deleted
        write_own_terms(found.found_car, made.parent)
    question = next(iter(found.diagnosis.undecided), None)
    return Explained(
        effects=tuple(_as_message(one) for one in effects),
        between=() if question is None else question.between,
        drive_this="" if question is None else question.drive_this,
        text=_in_words(found.diagnosis, effects) + (CUT if found.diagnosis.unanswered else ""),
        since_s=_since(effects),
        car_file=made if is_found else None,
        abilities=(
            compared_abilities(car, load_car(made), found.diagnosis.fit) if is_found else ()
        ),
    )


def _is_of(effect: Effect, onset_s: tuple[float, float]) -> bool:
    """Return whether an effect changed when the change was noticed to begin."""
    if effect.course is Course.CONSTANT:
        return False
    if effect.since_s is None:
        return True  # evenly all along
    low, high = onset_s
    return low - EARLIER_S <= effect.since_s.value <= high + LATER_S


def _since(effects: Sequence[Effect]) -> tuple[float, float, float] | None:
    dated = [one.since_s for one in effects if one.since_s is not None]
    return (dated[0].value, dated[0].low, dated[0].high) if dated else None


def _in_words(diagnosis: Diagnosis, effects: Sequence[Effect]) -> str:
    if effects:
        return " ".join(one.text for one in effects)
    if diagnosis.undecided:
        return f"It may be {' or '.join(diagnosis.undecided[0].between)}."
    if diagnosis.failure is not None:
        return diagnosis.failure.text
    return "No known effect that began then explains it."


def _as_message(effect: Effect) -> TwinEffect:
    parameters = tuple(
        TwinParameter(
            name=name, value=one.value, low=one.low, high=one.high, unit=one.unit,
            before=effect.before[name].value if name in effect.before else None,
        )
        for name, one in effect.parameters.items()
    )  # fmt: skip
    return TwinEffect(
        name=effect.name, probability=effect.probability, parameters=parameters, text=effect.text
    )


def compare(recording: Recording, car_file: str, new_file: str) -> Compared:
    """Drive windows of a recording again by two car files.

    Args:
        recording: On which neither was fitted.
        car_file: Name or path of the one.
        new_file: Of the other.

    Raises:
        ScmError: when a file cannot be used, or no window is whole.
    """
    car, new = load_car(car_file), load_car(new_file)
    stretches = prepare(recording, car).recordings
    drives = [Drive(one, car) for one in stretches]
    if not drives:
        raise RecordingError("no stretch of driving is long enough to compare two car files")
    spans = tuple(((float(one.edges[0]), float(one.edges[-1])),) for one in drives)
    none = Part(np.empty(0), tuple(() for _ in drives))
    fit, _ = judge(drives, car, new, Parts(none, none, Part(np.empty(0), spans)), HORIZON_S)
    part = fit.confirm
    errors = tuple(
        TwinError(name=name, before=part.before[name], now=now)
        for name, now in part.after.items()
        if name in part.before
    )
    return Compared(part.windows, errors, _better(part), nothing_got_worse(fit))


def _better(part: PartErrors) -> tuple[str, ...]:
    """Return which errors became smaller, beyond what noise of measuring may change."""
    swapped = structs.replace(part, before=part.after, after=part.before)
    return tuple(
        name for name, now in part.after.items()
        if name in part.before and got_worse(swapped, name, now, by=1.0 / BETTER)
    )  # fmt: skip


def why_failed(failure: Exception) -> str:
    """Return why a search or a comparison failed, in words."""
    if isinstance(failure, BrokenExecutor):
        return "The process that worked on it was killed."
    return str(failure)
