"""`scm trial`: effects concealed in an independent simulation, diagnosed blind, then scored."""

import argparse
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.dask_cluster import SCHEDULER_HELP

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from scm.progress import Progress


def _arguments(parser: argparse.ArgumentParser) -> None:
    from scm.mismatch.trial.run import ENGINES, FAMILIES, HALVES, KINDS

    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")
    parser.add_argument("--cases", type=int, default=40, help="how many (%(default)s)")
    parser.add_argument(
        "--kind", choices=KINDS, default="mixed", help="what to conceal (%(default)s)"
    )
    parser.add_argument(
        "--strength", type=float, nargs=2, default=(1.0, 4.0), metavar=("LOW", "HIGH"),
        help="size of effects, in multiples of the smallest that a drive can show (1 4)",
    )  # fmt: skip
    parser.add_argument(
        "--engine",
        choices=ENGINES,
        default="own",
        help="engine that simulates the cars (%(default)s)",
    )
    parser.add_argument(
        "--family", choices=FAMILIES, default="own",
        help="equations, drivers and sensors: always the same, or drawn per case (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--half", choices=HALVES, help="with --family drawn: half of the values to draw from (all)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="default: runs/trial-SEED, or -NAME of --trials"
    )
    parser.add_argument(
        "--trials", type=Path, metavar="DIR", help="diagnose these cases instead of simulating any"
    )
    parser.add_argument(
        "--only", default="", metavar="00,01", help="diagnose only these cases of --trials"
    )
    parser.add_argument(
        "--kept",
        action="store_true",
        help="score the stored diagnoses of --out again, without new ones",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, default=2, help="processes (%(default)s)")
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help=f"one case, one task; {SCHEDULER_HELP}"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.progress import Progress

    out = arguments.out or Path("runs") / f"trial-{_title(arguments)}"
    with closing(Progress(sys.stderr, WallClock())) as progress:
        lines = _table(arguments, out, progress)
    print("\n".join(lines))
    print(f"\nwritten to {out}: recordings, labels and their seals, each diagnosis, this table")
    return 0


def _table(arguments: argparse.Namespace, out: Path, progress: "Progress") -> list[str]:
    from scm.dask_cluster import cluster_executor
    from scm.mismatch.trial import run

    if arguments.kept:
        return run.judged_again(out, arguments.trials)
    if arguments.scheduler is None:
        with run.processes(arguments.workers) as executor:
            return _diagnosed(arguments, out, executor, progress)
    with cluster_executor(arguments.scheduler) as executor:  # its workers have other folders
        return _diagnosed(arguments, out.resolve(), executor, progress)


def _diagnosed(
    arguments: argparse.Namespace, out: Path, executor: "Executor | None", progress: "Progress"
) -> list[str]:
    from scm.mismatch.trial import run
    from scm.mismatch.trial.run import CaseRequest, by_engine

    if arguments.trials:
        only = [name for name in arguments.only.split(",") if name]
        folder = arguments.trials if arguments.scheduler is None else arguments.trials.resolve()
        return run.on_shipped_cases(
            folder, out, by_engine, only, executor=executor, notify=progress.step
        )
    low, high = arguments.strength
    plan = CaseRequest(
        seed=arguments.seed, cases=arguments.cases, kind=arguments.kind,
        engine=arguments.engine, strength=(low, high), family=arguments.family,
        half=arguments.half,
    )  # fmt: skip
    return run.on_own_cases(plan, out, by_engine, executor=executor, notify=progress.step)


def _title(arguments: argparse.Namespace) -> str:
    return str(arguments.trials.resolve().name if arguments.trials else arguments.seed)


COMMAND = Command(
    help="Conceal effects in an independent simulation, diagnose blind, and score the results.",
    example="scm trial --seed 7 --cases 20",
    arguments=_arguments,
    run=_run,
)
