"""`scm study search`: look for the case that breaks it."""

import argparse
import sys
from contextlib import closing

from scm.command import Command
from scm.commands.study_run import study_arguments


def _arguments(parser: argparse.ArgumentParser) -> None:
    study_arguments(parser, "runs/studies/NAME-search")
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
