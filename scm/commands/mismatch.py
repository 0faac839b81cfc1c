"""`scm mismatch`: what the simulator left out, found in recordings of a car."""

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.dask_cluster import SCHEDULER_HELP
from scm.mismatch.budget import DEFAULT_S, Budget

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from contextlib import AbstractContextManager

    from scm.mismatch.progress import Progress
    from scm.mismatch.validate.conclude import Result
    from scm.recording.read import Recording

FOLDER = "mismatch"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording", nargs="+", type=Path,
        help="description files, their folders, or the .mcap of a run",
    )  # fmt: skip
    parser.add_argument(
        "--car", metavar="FILE", help="car file or name, for one car; default: the recording's"
    )
    parser.add_argument("--vehicle", metavar="NAME", help="only this car of several")
    parser.add_argument(
        "--told", nargs="+", type=Path, default=[], metavar="DIR",
        help="further drives of the same car by scm play, used as a whole",
    )  # fmt: skip
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="folder of the tables; default: beside the description",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"the report's folder; default: runs/{FOLDER}-NAME"
    )
    parser.add_argument(
        "--from-s", type=float, metavar="S", help="leave out everything before, from its start"
    )
    parser.add_argument(
        "--to-s", type=float, metavar="S", help="leave out everything after, from its start"
    )
    parser.add_argument(
        "--budget-s",
        type=float,
        default=DEFAULT_S,
        help="time for each car; the report lists the questions left open then [s] (%(default)g)",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse a recording in which rows must be left out or repaired",
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help=f"several cars: one car, one task; {SCHEDULER_HELP}"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.mismatch.progress import Progress
    from scm.mismatch.several.diagnose import with_played

    name = arguments.recording[0].resolve()
    title = name.parent.name if name.name == "recording.yaml" else name.stem
    out = arguments.out or Path("runs") / f"{FOLDER}-{title}"
    budget = Budget(arguments.budget_s, WallClock())  # reading counts
    progress = Progress(sys.stderr, WallClock())
    try:
        if arguments.car is None and arguments.vehicle is None:
            cars, failed = _cars(arguments)
            cars = with_played(cars, arguments.told)
            text, failed = _of_cars(cars, failed, arguments, out, progress, budget)
        else:
            text, failed = _of_one(arguments, out, progress), ()
    finally:
        progress.close()
    print(text)
    for why in failed:
        print(f"scm mismatch: {why}", file=sys.stderr)
    return 0


def _cars(arguments: argparse.Namespace) -> "tuple[dict[str, list[Recording]], tuple[str, ...]]":
    """Return the recordings of each car, and why there are none of others."""
    from scm.errors import RecordingError
    from scm.mismatch.several.diagnose import cars_of
    from scm.recording.span import part_of

    cars: dict[str, list[Recording]] = {}
    failed: list[str] = []
    found = cars_of(arguments.recording, arguments.data, warn=failed.append)
    for name, recordings in found.items():
        try:
            cars[name] = [part_of(one, arguments.from_s, arguments.to_s) for one in recordings]
        except RecordingError as error:
            failed.append(str(error))
    if not cars:
        raise RecordingError("\n".join(failed))
    return cars, tuple(failed)


def _of_one(arguments: argparse.Namespace, out: Path, progress: "Progress") -> str:
    """Diagnose one car, write its report, and return what to print."""
    from scm.mismatch.pipeline import diagnose, write
    from scm.mismatch.report.record import since_start
    from scm.mismatch.report.write import summary

    found = diagnose(
        arguments.recording, arguments.car, arguments.data, vehicle=arguments.vehicle,
        span_s=(arguments.from_s, arguments.to_s), played=arguments.told,
        budget_s=arguments.budget_s, strict=arguments.strict, notify=progress.notify,
    )  # fmt: skip
    progress.notify("writing the report")
    check = _check(arguments, out)
    write(found, out, check)
    text = summary(since_start(found.diagnosis, found.evidence), out, found.evidence.retuned_m)
    return _with_account(found, text, check)


def _of_cars(
    cars: "Mapping[str, Sequence[Recording]]",
    failed: tuple[str, ...],
    arguments: argparse.Namespace,
    out: Path,
    progress: "Progress",
    budget: Budget,
) -> tuple[str, tuple[str, ...]]:
    """Diagnose cars by their own files and write the report or reports.

    Returns:
        What to print, and why other cars could not be diagnosed.
    """
    from scm.errors import RunError
    from scm.mismatch.pipeline import write
    from scm.mismatch.report.cars_page import several_summary
    from scm.mismatch.report.record import since_start
    from scm.mismatch.report.write import summary
    from scm.mismatch.several.diagnose import diagnose_one, diagnose_several, write_all

    budget_s, strict = arguments.budget_s, arguments.strict
    if len(cars) == 1:
        if arguments.scheduler is not None:
            msg = f"--scheduler {arguments.scheduler}: one car is one task: expected several cars"
            raise RunError(msg)
        ((name, recordings),) = cars.items()
        found = diagnose_one(recordings, budget=budget, strict=strict, notify=progress.notify)
        progress.notify("writing the report")
        check = _check(arguments, out, name if failed else "")
        write(found, out, check)
        text = summary(since_start(found.diagnosis, found.evidence), out, found.evidence.retuned_m)
        return _with_account(found, text, check), failed
    with _executor(arguments.scheduler) as executor:
        several = diagnose_several(
            cars, budget_s=budget_s, strict=strict, notify=progress.notify, turn=progress.turn,
            executor=executor,
        )  # fmt: skip
    several = replace(several, failed=(*failed, *several.failed))
    progress.notify("writing the reports")
    write_all(several, out, lambda name: _check(arguments, out / name, name))
    diagnoses = {name: found.diagnosis for name, found in several.cars.items()}
    read = [f"{name}: {line}" for name, found in several.cars.items() for line in found.account]
    text = several_summary(diagnoses, several.common, out)
    return "\n".join((*read, text)), several.failed


def _executor(scheduler: str | None) -> "AbstractContextManager[Executor | None]":
    from contextlib import nullcontext

    from scm.dask_cluster import cluster_executor

    return nullcontext() if scheduler is None else cluster_executor(scheduler)


def _check(arguments: argparse.Namespace, out: Path, vehicle: str = "") -> str:
    """Return the command that works out a report's figures again."""
    paths = [*arguments.recording, *arguments.told]
    words = ["scm", "replay", *map(str, paths), "--report", str(out)]
    for option, value in (
        ("--vehicle", vehicle or arguments.vehicle), ("--data", arguments.data),
        ("--from-s", arguments.from_s), ("--to-s", arguments.to_s),
    ):  # fmt: skip
        words += [option, str(value)] if value is not None else []
    spanned = arguments.from_s is not None or arguments.to_s is not None
    return "" if arguments.told and spanned else shlex.join(words)


def _with_account(found: "Result", text: str, check: str) -> str:
    """Return the summary between the lines on which rows were read and how to check it."""
    again = (f"  recomputed figures: {check}",) if check and found.diagnosis.fit else ()
    return "\n".join((*found.account, text, *again))


COMMAND = Command(
    help="Find what the simulator left out.",
    example="scm mismatch trial/drive --out found",
    arguments=_arguments,
    run=_run,
)
