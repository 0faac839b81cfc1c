"""The command line: `scm <command> ...`, one file of `scm/commands` a command."""

import argparse
import logging
import sys
from collections.abc import Sequence

from scm import __version__
from scm.errors import ScmError


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    from scm.command import Command
    from scm.registry import load, names

    parser = argparse.ArgumentParser(prog="scm", description="Smart City Manager for scaled cars.")
    parser.add_argument("--version", action="version", version=f"scm {__version__}")
    parser.add_argument(
        "--log", default="warning", metavar="LEVEL", help="debug, info, warning, error"
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in names("scm.commands"):
        command = load("scm.commands", name, "COMMAND", Command)
        sub = commands.add_parser(
            name,
            help=command.help,
            description=command.help,
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
        print(f"scm {arguments.command}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # `scm show ... | head`
        return 0
    return code


if __name__ == "__main__":
    sys.exit(main())
