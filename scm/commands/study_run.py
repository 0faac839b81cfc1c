"""`scm study run`: all cases of a study file, on all cores or a cluster; resumable."""

import argparse
import sys
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.study.engine import Engine
    from scm.study.results import Results


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", type=Path, metavar="STUDY", help="the study file, a .toml")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (runs/studies/NAME)"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=int, metavar="N", help="processes on this machine (one a core)"
    )
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask cluster that exists: tcp://head:8786"
    )
    where.add_argument(
        "--slurm", metavar="OPTIONS", help='Slurm, with options of sbatch: "-p cpu -n 64"'
    )
    parser.add_argument(
        "--fail-fast", action="store_true", help="end at the first case that does not end by itself"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.study.live_table import LiveTable
    from scm.study.loaded_study import load
    from scm.study.results import STUDIES, create_results
    from scm.study.run import run_study

    study = load(arguments.study)
    folder = arguments.out or STUDIES / study.file.name
    results = create_results(study, folder, sys.argv)
    with _engine(arguments, results) as engine, closing(LiveTable(sys.stderr, results)) as table:
        table.show(engine.about)
        try:
            end = run_study(results, engine, table.add, fail_fast=arguments.fail_fast)
        except KeyboardInterrupt:
            table.close()
            results.write()
            rows = len(results.rows)
            print(f"stopped with {rows} of {len(study.design)} cases: the same command goes on")
            return 130
    from scm.study.text_report import text_report

    print("\n".join(text_report(results)))
    print(f"\n{end.why}; written to {folder}; scm study show {folder} --html")
    return 0


def _engine(arguments: argparse.Namespace, results: "Results") -> "AbstractContextManager[Engine]":
    from scm.study.engine import cores, dask_engine, local_engine, slurm_engine

    study, folder = results.study, results.folder
    if arguments.slurm is not None:
        return nullcontext(slurm_engine(study, folder, arguments.slurm))
    if arguments.scheduler is not None:
        return dask_engine(study, folder, arguments.scheduler)
    return local_engine(study, folder, arguments.workers or cores())


COMMAND = Command(
    help="Run a scenario in many cities: all cases of a study file, on all cores or a cluster.",
    example="scm study run studies/signal_policies.toml",
    arguments=_arguments,
    run=_run,
)
