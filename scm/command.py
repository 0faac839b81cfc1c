"""The contract of a command of the command line, and what all commands that run a part share."""

import argparse
import gc
from collections.abc import Callable
from dataclasses import dataclass

from scm.part import Part
from scm.v2x.router import DEFAULT_ENDPOINT


@dataclass(frozen=True, slots=True)
class Command:
    """One command: `scm <file name>`.

    Attributes:
        help: One line for `scm --help`.
        example: A call that works, shown by `scm <command> --help`.
        arguments: Adds the command's own arguments to its parser.
        run: Does it; returns the exit code: 0 done, 2 bad input, 1 our fault.
    """

    help: str
    example: str
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


def part_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what every part of the city needs to know: its map and where the bus is."""
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router (%(default)s)"
    )
    parser.add_argument("--city", default="city", help="whose keys to use (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")


def run_part(part: Part, arguments: argparse.Namespace) -> int:
    """Run one part on the real bus and clock until Ctrl-C or SIGTERM."""
    from scm.clock import WallClock
    from scm.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus

    stop = stop_on_signal()
    with ZenohBus(arguments.city, part.name, arguments.connect) as bus:
        run(part, bus, WallClock(), stop)
    gc.freeze()  # taking the compiler's objects apart one by one would take a third of a second
    return 0
