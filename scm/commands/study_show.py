"""`scm study show`: what came of a study."""

import argparse
from pathlib import Path

from scm.command import Command

PAGE = "study.html"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study's results")
    parser.add_argument(
        "--html", action="store_true", help=f"write one self-contained page, {PAGE}, there"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.study.results import open_results
    from scm.study.text_report import text_report

    results = open_results(arguments.folder)
    if not arguments.html:
        print("\n".join(text_report(results)))
        return 0
    from scm.study.page import study_page

    path = arguments.folder / PAGE
    path.write_text(study_page(results), "utf-8")
    print(f"written: {path}")
    return 0


COMMAND = Command(
    help="Show a study: failures first, success and measures by factor, main effects; or a page.",
    example="scm study show runs/studies/signal_policies --html",
    arguments=_arguments,
    run=_run,
)
