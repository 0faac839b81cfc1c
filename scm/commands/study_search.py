"""`scm study search`: look for the case that breaks it."""

import argparse
import sys
from contextlib import closing
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "study", type=Path, metavar="STUDY", help="a study file with [search] in it"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the results (runs/studies/NAME-search)"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=int, metavar="N", help="processes on this machine (one a core)"
    )
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask cluster that exists: tcp://head:8786"
    )
    parser.add_argument(
        "--storage", default="", metavar="URL",
        help="share the search with other commands: postgresql://user@host/database",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.study.engine import engine_of
    from scm.study.live_table import LiveTable
    from scm.study.loaded_study import load
    from scm.study.results import create_results
    from scm.study.search import found_lines, run_search
    from scm.study.stored import STUDIES

    study = load(arguments.study)
    folder = arguments.out or STUDIES / f"{study.file.name}-search"
    results = create_results(study, folder, sys.argv)
    goal = study.file.study.search
    cases = 0 if goal is None else goal.cases
    results.note(cases=cases)
    with (
        engine_of(study, folder, arguments.workers, arguments.scheduler) as engine,
        closing(LiveTable(sys.stderr, results, cases)) as table,
    ):
        table.show(engine.about)
        try:
            found = run_search(results, engine, table.add, arguments.storage)
        except KeyboardInterrupt:
            table.close()
            results.write()
            print(f"stopped with {len(results.rows)} of {cases} cases: the same command goes on")
            return 130
    print("\n".join(found_lines(results, found)))
    return 0


COMMAND = Command(
    help="Search the factors of a study file for the case with the worst measure, by Optuna.",
    example="scm study search studies/worst_gap.toml",
    arguments=_arguments,
    run=_run,
)
