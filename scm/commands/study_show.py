"""`scm study show`: what came of a study."""

import argparse
from pathlib import Path

from scm.command import Command

PAGE = "study.html"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study's results")
    how = parser.add_mutually_exclusive_group()
    how.add_argument(
        "--html", action="store_true", help=f"write one self-contained page, {PAGE}, there"
    )
    how.add_argument(
        "--json", action="store_true", help="print it for programs, as GET /studies/NAME does"
    )


def _run(arguments: argparse.Namespace) -> int:
    import msgspec

    from scm.study.stored import read_results

    results = read_results(arguments.folder)
    if arguments.json:
        from scm.study.record import study_record

        print(msgspec.json.encode(study_record(results)).decode())
    elif arguments.html:
        from scm.study.page import study_page

        path = arguments.folder / PAGE
        new = path.with_suffix(".new")
        new.write_text(study_page(results), "utf-8")
        new.replace(path)  # it is whole or not there
        print(f"written: {path}")
    else:
        from scm.study.text_report import text_report

        print("\n".join(text_report(results)))
    return 0


COMMAND = Command(
    help="Show a study: failures first, success and measures by factor, main effects; or a page.",
    example="scm study show runs/studies/signal_policies --html",
    arguments=_arguments,
    run=_run,
)
