"""The contract of a command of the command line, and what all commands that run a part share."""

import argparse
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scm.errors import MapError
from scm.runtime.part import Part
from scm.store.repository import Repository
from scm.v2x.router import DEFAULT_ENDPOINT

if TYPE_CHECKING:
    from scm.v2x.credentials import Credentials


@dataclass(frozen=True, slots=True)
class Command:
    """One command: `scm <file name>`.

    Attributes:
        help: One line for `scm --help`.
        example: A call that works, shown by `scm <command> --help`.
        arguments: Adds the command's own arguments to its parser.
        run: Does it; returns the exit code: 0 done, 2 bad input, 1 a bug.
    """

    help: str
    example: str
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


def credentials_argument(parser: argparse.ArgumentParser) -> None:
    """Add the credentials of a station, for a guarded city."""
    parser.add_argument(
        "--credentials",
        type=Path,
        metavar="FILE",
        help="credentials of this station, from `scm fleet add`; not needed in an open city",
    )


def credentials_of(
    arguments: argparse.Namespace, station: str | None = None
) -> "Credentials | None":
    """Return the credentials that were given, of this station; None: none were.

    Raises:
        AccessError: when they cannot be read, or are another station's.
    """
    if arguments.credentials is None:
        return None
    from scm.v2x.credentials import read_credentials

    return read_credentials(arguments.credentials, station)


def place(text: str) -> str:
    """Return a spawn place's name, or coordinates, as an argument of the command line."""
    from scm.maps.coordinates import checked_place

    try:
        return checked_place(text)
    except MapError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from wrong


def spawn_argument(parser: argparse.ArgumentParser) -> None:
    """Add where a car is put down."""
    parser.add_argument(
        "--spawn",
        type=place,
        default="",
        metavar="PLACE",
        help="a spawn place of the map, or X,Y,DEG: metres and degrees in the map frame "
        "(--spawn=-1,0,90 where X is below 0); default: any free place",
    )


def part_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what every part of the city needs to know: its map and where the bus is."""
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router (%(default)s)"
    )
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")


def agent_arguments(parser: argparse.ArgumentParser, name_help: str) -> None:
    """Add what every program of a car needs to know: where the bus is, and its name there."""
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT",
        help="the city's router (%(default)s)",
    )  # fmt: skip
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--name", help=name_help)


def state_argument(parser: argparse.ArgumentParser) -> None:
    """Add where a part stores what must outlive it."""
    parser.add_argument(
        "--state",
        metavar="URL",
        help="store of what must outlive this process, sqlite:PATH or postgresql://...",
    )


@contextmanager
def state_of(arguments: argparse.Namespace) -> Iterator[Repository | None]:
    """Open the store that was asked for; None: nothing outlives the process.

    Raises:
        StoreError: when it cannot be opened.
    """
    if arguments.state is None:
        yield None
        return
    from scm.store.open import open_store

    store = open_store(arguments.state)
    try:
        yield store
    finally:
        store.close()


def run_part(part: Part, arguments: argparse.Namespace, state: Repository | None = None) -> int:
    """Run one part on the real bus and clock until Ctrl-C or SIGTERM."""
    from scm.clock import WallClock
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus

    stop = stop_on_signal()
    credentials = credentials_of(arguments, part.name)
    with ZenohBus(arguments.city, part.name, arguments.connect, credentials=credentials) as bus:
        run(part, bus, WallClock(), stop, state)
    gc.freeze()  # taking the compiler's objects apart one by one would take a third of a second
    return 0
