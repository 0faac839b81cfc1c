"""The command line of the agent: `vehicle-agent join --name n7 --connect tcp/HOST:PORT`."""

import argparse
import gc
import logging
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from scm import __version__
from scm.errors import ScmError

EXAMPLE = "example: vehicle-agent join --name n7 --connect tcp/127.0.0.1:7447"


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    parser = argparse.ArgumentParser(
        prog="vehicle-agent", description="The program of one car.", epilog=EXAMPLE
    )
    parser.add_argument("--version", action="version", version=f"scm {__version__}")
    parser.add_argument(
        "--log",
        default="info",
        choices=["debug", "info", "warning", "error"],
        help="how much to log (%(default)s)",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    join = commands.add_parser(
        "join",
        help="join a city with a car of one's own dynamics, and drive until Ctrl-C",
        description="Join a city with a car of one's own dynamics, and drive until Ctrl-C.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    join.add_argument("--name", required=True, help="of the vehicle: a-z 0-9 _ -")
    join.add_argument("--connect", required=True, metavar="ENDPOINT", help="the city's router")
    join.add_argument(
        "--credentials",
        type=Path,
        metavar="FILE",
        help="who this car is, from `scm fleet add`; not needed where anybody may enter",
    )
    join.add_argument("--city", default="city", help="whose keys to use (%(default)s)")
    join.add_argument("--car", default="nigel", help="car file (%(default)s)")
    join.add_argument("--spawn", default="", help="place to start at; default: any free one")
    join.add_argument("--seed", type=int, default=0, help="of the sensors' noise (%(default)s)")
    join.set_defaults(run=_join)
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


def _join(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.credentials import read_credentials
    from scm.v2x.key import check_name
    from vehicle_agent.agent import AgentPart
    from vehicle_agent.leaving import Leaving

    check_name(arguments.name, "--name")
    check_name(arguments.city, "--city")
    who = arguments.credentials
    credentials = read_credentials(who, arguments.name) if who is not None else None
    wish, done, clock = stop_on_signal(), threading.Event(), WallClock()
    with ZenohBus(
        arguments.city, arguments.name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = AgentPart(
            arguments.name, arguments.car, arguments.spawn, bus.session, arguments.seed
        )
        run(Leaving(part, wish, done), bus, clock, done, on_beat=True)
    gc.freeze()  # taking the compiler's objects apart one by one would take a quarter of a second
    return 0


if __name__ == "__main__":
    sys.exit(main())
