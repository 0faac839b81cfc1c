"""`scm twin`: one part of the city, on its own."""

import argparse

from scm.command import Command, part_arguments, run_part


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    parser.add_argument(
        "--false-alarm-h", type=float, default=200.0, metavar="HOURS",
        help="of driving, in which a car that does not change may be reported once (%(default)g)",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.twin.part import TwinPart

    return run_part(TwinPart(arguments.false_alarm_h), arguments)


COMMAND = Command(
    help="Watch every car, and report since when one is not what its car file says.",
    example="scm twin driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
