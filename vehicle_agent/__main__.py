"""The command line of the agent: `vehicle-agent join --name n7 --connect tcp/HOST:PORT`."""

import argparse
import logging
import sys
from collections.abc import Sequence

from scm import __version__
from scm.command import Command
from scm.errors import ScmError
from scm.registry import load, names

COMMANDS = "vehicle_agent.commands"


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    parser = argparse.ArgumentParser(
        prog="vehicle-agent",
        description="The program of one car.",
        epilog="example: vehicle-agent join --name n7 --connect tcp/127.0.0.1:7447",
    )
    parser.add_argument("--version", action="version", version=f"scm {__version__}")
    parser.add_argument(
        "--log",
        default="info",
        choices=["debug", "info", "warning", "error"],
        help="how much to log (%(default)s)",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in names(COMMANDS):
        command = load(COMMANDS, name, "COMMAND", Command)
        sub = commands.add_parser(
            name.replace("_", "-"),
            help=command.help,
            description=f"{command.help[0].upper()}{command.help[1:]}.",
            epilog=f"example: {command.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return 0 done, 2 bad input, 1 our fault."""
    arguments = build_parser().parse_args(argv)
    logging.basicConfig(
        level=arguments.log.upper(), format="%(asctime)s %(levelname)s %(name)s %(message)s"
    )
    try:
        code: int = arguments.run(arguments)
    except ScmError as error:
        print(f"vehicle-agent {arguments.command}: {error}", file=sys.stderr)
        return 2
    return code


if __name__ == "__main__":
    sys.exit(main())
