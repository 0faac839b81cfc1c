"""`scm fleet remove`: remove a station from the city's fleet."""

import argparse

from scm.command import Command
from scm.commands.fleet_add import fleet_argument


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="of the station")
    fleet_argument(parser)


def _run(arguments: argparse.Namespace) -> int:
    from scm.v2x.fleet_file import load_fleet, remove

    remove(load_fleet(arguments.fleet), arguments.name)
    print(f"{arguments.name} is removed. A running router admits it until its next start.")
    return 0


COMMAND = Command(
    help="Remove a station from the fleet file.",
    example="scm fleet remove n7",
    arguments=_arguments,
    run=_run,
)
