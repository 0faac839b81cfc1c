"""`scm mismatch`: what the simulator left out, found in recordings of a car."""

import argparse
import sys
from pathlib import Path

from scm.command import Command

FOLDER = "mismatch"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recording", nargs="+", type=Path,
        help="description files, their folders, or .mcap of a city: of one car",
    )  # fmt: skip
    parser.add_argument("--car", metavar="FILE", help="car file or name; default: the recording's")
    parser.add_argument("--vehicle", metavar="NAME", help="of several cars this one")
    parser.add_argument(
        "--data", type=Path, metavar="DIR", help="where the tables are; default: beside"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"the report's folder; default: runs/{FOLDER}-NAME"
    )
    parser.add_argument(
        "--budget-s", type=float, default=120.0, help="time for the search (%(default)s)"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.mismatch.diagnose import diagnose, write
    from scm.mismatch.progress import Progress
    from scm.mismatch.report.summary import summary

    name = arguments.recording[0].resolve()
    title = name.parent.name if name.name == "recording.yaml" else name.stem
    out = arguments.out or Path("runs") / f"{FOLDER}-{title}"
    progress = Progress(sys.stderr, WallClock())
    try:
        found = diagnose(
            arguments.recording, arguments.car, arguments.data, vehicle=arguments.vehicle,
            budget_s=arguments.budget_s, tell=progress.tell,
        )  # fmt: skip
        progress.tell("writing the report")
        write(found, out)
    finally:
        progress.close()
    print(summary(found.diagnosis, out))
    return 0


COMMAND = Command(
    help="find what the simulator left out",
    example="scm mismatch trial/drive --out found",
    arguments=_arguments,
    run=_run,
)
