"""`scm record`: everything on the bus into an MCAP file."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE", help="the .mcap to write"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.recorder.part import RecorderPart

    return run_part(RecorderPart(arguments.out, arguments.city), arguments)


COMMAND = Command(
    help="Record everything on the bus; what is older than half a second survives a kill.",
    example="scm record --out runs/today.mcap",
    arguments=_arguments,
    run=_run,
)
