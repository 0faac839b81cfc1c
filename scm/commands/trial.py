"""`scm trial`: effects concealed in an independent simulation, diagnosed blind, then scored.

With `--live`, cars of that simulation change in a running city, and the twin part is scored.
"""

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

CASES, STRENGTH, LIVE_STRENGTH = 40, (1.0, 4.0), (2.0, 3.0)


def _arguments(parser: argparse.ArgumentParser) -> None:
    from scm.mismatch.trial.run import ENGINES, FAMILIES, HALVES, KINDS

    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")
    parser.add_argument(
        "--cases", type=int, help=f"how many ({CASES}); with --live: how many cities (1)"
    )
    parser.add_argument(
        "--kind", choices=KINDS, default="mixed", help="what to conceal (%(default)s)"
    )
    parser.add_argument(
        "--strength", type=float, nargs=2, metavar=("LOW", "HIGH"),
        help="size of effects, in multiples of the smallest that can be shown (1 4; --live: 2 3)",
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
    _live_arguments(parser)
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, default=2, help="processes (%(default)s)")
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help=f"one case, one task; {SCHEDULER_HELP}"
    )


def _live_arguments(parser: argparse.ArgumentParser) -> None:
    live = parser.add_argument_group(
        "live", "cars change in a running city; --kind mixed or none, --engine, --seed as above"
    )
    live.add_argument("--live", action="store_true", help="score scm twin instead of scm mismatch")
    live.add_argument("--cars", type=int, default=6, help="of each city (%(default)s)")
    live.add_argument("--hours", type=float, default=2.0, help="of its time (%(default)g)")
    live.add_argument("--map", default="driving_school", help="(%(default)s)")
    live.add_argument(
        "--budget-s", type=float, default=300.0, help="of processor time, a search (%(default)g)"
    )
    live.add_argument(
        "--no-search", action="store_true", help="notice and attribute changes, name none"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.progress import Progress

    if arguments.live:
        return _run_live(arguments)
    out = arguments.out or Path("runs") / f"trial-{_title(arguments)}"
    with closing(Progress(sys.stderr, WallClock())) as progress:
        lines = _table(arguments, out, progress)
    print("\n".join(lines))
    print(f"\nwritten to {out}: recordings, labels and their seals, each diagnosis, this table")
    return 0


def _run_live(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.errors import RunError
    from scm.mismatch.trial.run import processes
    from scm.progress import Progress
    from scm.twin.trial import run
    from scm.twin.trial.city import CityRequest

    for option, usual in (("trials", None), ("scheduler", None), ("family", "own"), ("only", "")):
        if getattr(arguments, option) != usual:
            raise RunError(f"--{option}: not with --live")
    if arguments.kind not in ("mixed", "none"):
        raise RunError(f"--kind: expected mixed or none with --live, got {arguments.kind}")
    out = arguments.out or Path("runs") / f"trial-live-{arguments.seed}"
    low, high = arguments.strength or LIVE_STRENGTH
    city = CityRequest(
        seed=arguments.seed, cars=arguments.cars, hours=arguments.hours, engine=arguments.engine,
        strength=(low, high), healthy=arguments.kind == "none", map=arguments.map,
        search=not arguments.no_search, budget_s=arguments.budget_s,
    )  # fmt: skip
    cities = 1 if arguments.cases is None else arguments.cases
    trial = run.LiveTrial(city, cities)
    if arguments.kept:
        rows = run.judged_again(out)
    else:
        run.check(trial)
        workers = min(arguments.workers, cities) if cities > 1 else 0
        with closing(Progress(sys.stderr, WallClock())) as progress, processes(workers) as executor:
            rows = run.run(trial, out, executor, progress.step)
    print("\n".join(rows))
    print(f"\nwritten to {out}: labels and their seals, what cities found, result.json, this table")
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
    low, high = arguments.strength or STRENGTH
    cases = CASES if arguments.cases is None else arguments.cases
    plan = CaseRequest(
        seed=arguments.seed, cases=cases, kind=arguments.kind,
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
