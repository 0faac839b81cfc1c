"""`scm study run`: all cases of a study file, on all cores or a cluster; resumable."""

import argparse
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

from scm.command import Command


def study_arguments(parser: argparse.ArgumentParser, out: str) -> Any:
    """Add a study, where its results go and what runs it; return the group of what runs it."""
    parser.add_argument("study", type=Path, metavar="STUDY", help="the study file, a .toml")
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder of the results ({out})")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=int, metavar="N", help="processes on this machine (one a core)"
    )
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask cluster that exists: tcp://head:8786"
    )
    return where


def _arguments(parser: argparse.ArgumentParser) -> None:
    where = study_arguments(parser, "runs/studies/NAME")
    where.add_argument(
        "--slurm", metavar="OPTIONS", help='Slurm, with options of sbatch: "-p cpu -n 64"'
    )
    parser.add_argument(
        "--fail-fast", action="store_true", help="end at the first case that does not end by itself"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.study.engine import engine_of
    from scm.study.live_table import LiveTable
    from scm.study.loaded_study import load
    from scm.study.results import create_results
    from scm.study.run import run_study
    from scm.study.stored import STUDIES
    from scm.study.text_report import text_report

    study = load(arguments.study)
    folder = arguments.out or STUDIES / study.file.name
    results = create_results(study, folder, sys.argv)
    chosen = arguments.workers, arguments.scheduler, arguments.slurm
    with (
        engine_of(study, folder, *chosen) as engine,
        closing(LiveTable(sys.stderr, results, len(study.design))) as table,
    ):
        table.show(engine.about)
        try:
            end = run_study(results, engine, table.add, fail_fast=arguments.fail_fast)
        except KeyboardInterrupt:
            table.close()
            results.write()
            rows = len(results.rows)
            print(f"stopped with {rows} of {len(study.design)} cases: the same command goes on")
            return 130
    print("\n".join(text_report(results)))
    print(f"\n{end.why}; written to {folder}; scm study show {folder} --html")
    return 0


COMMAND = Command(
    help="Run a scenario in many cities: all cases of a study file, on all cores or a cluster.",
    example="scm study run studies/signal_policies.toml",
    arguments=_arguments,
    run=_run,
)
