"""`scm twin`: one part of the city, on its own."""

import argparse
from pathlib import Path

from scm.command import Command, part_arguments, run_part, state_argument, state_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    part_arguments(parser)
    state_argument(parser)
    parser.add_argument(
        "--false-alarm-h", type=float, default=200.0, metavar="HOURS",
        help="of driving, in which a car that does not change may be reported once (%(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--data",
        type=Path,
        default=Path("runs"),
        metavar="DIR",
        help="reports and car files of what changed go there (%(default)s)",
    )
    parser.add_argument(
        "--budget-s",
        type=float,
        default=300.0,
        metavar="S",
        help="processor time for a search for what changed (%(default)g)",
    )
    parser.add_argument(
        "--send",
        choices=("agreed", "idle"),
        default="agreed",
        help="send cars to where they decide whose a change is: when an operator has agreed, or "
        "whenever they are idle (%(default)s)",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.records.twins import TwinChange, TwinVersion
    from scm.store.records import records
    from scm.twin.car import CHANGES, VERSIONS
    from scm.twin.part import TwinPart

    with state_of(arguments) as state:
        part = TwinPart(
            arguments.false_alarm_h,
            arguments.data.resolve(),
            arguments.budget_s,
            versions={}
            if state is None
            else records(state, "twins", f"twin/{VERSIONS}", TwinVersion),
            changes={} if state is None else records(state, "twins", f"twin/{CHANGES}", TwinChange),
            send=arguments.send,
        )
        return run_part(part, arguments, state)


COMMAND = Command(
    help="Watch every car, and report since when one is not what its car file says.",
    example="scm twin driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
