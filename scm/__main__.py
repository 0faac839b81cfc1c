"""The command line: `scm <command> ...`, one file of `scm/commands` a command.

A command of two words, `scm eye detect`, is the file `eye_detect`; further ones are joined by
hyphens, `scm camera calibrate-look` is `camera_calibrate_look`.
"""

import argparse
import errno
import logging
import os
import sys
from collections.abc import Sequence
from itertools import pairwise

from scm import __version__
from scm.errors import ScmError

INTERRUPTED = 130  # what a shell reports for a command ended by Ctrl-C


def build_parser(only: str | None = None) -> argparse.ArgumentParser:
    """Return the parser of the whole command line, or of `only` one command's.

    Importing all commands takes half the time of a small one, and a city starts a dozen processes.
    """
    from scm.command import Command
    from scm.registry import load, names

    parser = argparse.ArgumentParser(prog="scm", description="Smart City Manager for scaled cars.")
    parser.add_argument("--version", action="version", version=f"scm {__version__}")
    parser.add_argument(
        "--log",
        default="warning",
        type=str.lower,
        choices=("debug", "info", "warning", "error"),
        metavar="LEVEL",
        help="debug, info, warning, error (%(default)s); debug also shows where a failure happened",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name in names("scm.commands") if only is None else [only]:
        command = load("scm.commands", name, "COMMAND", Command)
        sub = commands.add_parser(
            _words(name),
            help=command.help,
            description=command.help,
            epilog=f"example: {command.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return parser


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the parsed arguments after `scm`."""
    joined = _joined(argv)
    parser = build_parser(_command_name(joined))
    seconds = _seconds(argv)
    if seconds:
        parser.error(f"expected a second word, as in `scm {argv[0]} {seconds[0]}`: {seconds}")
    return parser.parse_args(joined)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return 0 done, 2 bad input, 1 a bug, 130 ended by Ctrl-C."""
    arguments = parse(sys.argv[1:] if argv is None else argv)
    logging.basicConfig(
        level=arguments.log.upper(), format="%(asctime)s %(levelname)s %(name)s %(message)s"
    )
    try:
        code: int = arguments.run(arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # `scm show ... | head`
        _forget_stdout()
        return 0
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:  # noqa: BLE001  the edge of the process
        return _report(arguments.command, error)
    return code


def _words(name: str) -> str:
    """Return a command as it is typed, by the name of its file."""
    first, _, others = name.partition("_")
    return f"{first} {others.replace('_', '-')}".strip()


def _known() -> dict[str, str]:
    """Return the name of each command's file, by the command as it is typed."""
    from scm.registry import names

    return {_words(name): name for name in names("scm.commands")}


def _joined(argv: Sequence[str]) -> list[str]:
    """Return the arguments with the two words of a command as one."""
    known = _known()
    for i, (first, second) in enumerate(pairwise(argv)):
        if f"{first} {second}" in known:
            return [*argv[:i], f"{first} {second}", *argv[i + 2 :]]
        if first in known:
            break
    return list(argv)


def _command_name(joined: Sequence[str]) -> str | None:
    """Return the file of the requested command, or None if there is none of that name."""
    at = 2 if joined[:1] == ["--log"] else 0
    return _known().get(joined[at]) if len(joined) > at else None


def _seconds(argv: Sequence[str]) -> list[str]:
    """Return the possible second words of an incomplete command; empty if it is complete."""
    known = _known()
    first = argv[0] if argv else ""
    seconds = [name.removeprefix(f"{first} ") for name in known if name.startswith(f"{first} ")]
    is_whole = first in known or (len(argv) > 1 and argv[1] in seconds)
    return [] if is_whole else seconds


def _report(command: str, error: Exception) -> int:
    """Print why a command failed in one message; return 2 for bad input, 1 for a bug."""
    logging.getLogger(__name__).debug("%s failed", command, exc_info=error)
    place = isinstance(error, OSError) and (error.filename or error.errno == errno.ENOSPC)
    if place or isinstance(error, ScmError):
        print(f"scm {command}: {error}", file=sys.stderr)
        return 2
    print(
        f"scm {command}: unexpected {type(error).__name__}: {error}\n"
        f"This is a bug: `scm --log debug {command} ...` shows where it happened.",
        file=sys.stderr,
    )
    return 1


def _forget_stdout() -> None:
    """Discard what the interpreter flushes at its end: the reader is gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
