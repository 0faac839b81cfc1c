"""`scm up`: the whole city, one process a part."""

import argparse
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command
from scm.commands.api import proxy_arguments
from scm.commands.record import camera_arguments

if TYPE_CHECKING:
    from scm.runtime.up import CityOptions


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument("--hosted", type=int, default=4, help="cars of the world (%(default)s)")
    parser.add_argument(
        "--agents", type=int, default=2, help="vehicle agents to start (%(default)s)"
    )
    parser.add_argument("--port", type=int, default=8000, help="of the dashboard (%(default)s)")
    parser.add_argument(
        "--listen", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router (%(default)s)"
    )
    parser.add_argument(
        "--record-dir", type=Path, default=Path("runs"), help="recordings (%(default)s)"
    )
    camera_arguments(parser)
    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")
    parser.add_argument(
        "--fleet",
        type=Path,
        metavar="FILE",
        help="stations that may enter, from `scm fleet add`; default: everybody on this machine",
    )
    parser.add_argument(
        "--state",
        metavar="URL",
        help="store of what must survive a restart, sqlite:PATH or postgresql://...; default: a "
        "new file beside the recording",
    )
    parser.add_argument("--host", default="127.0.0.1", help="of the dashboard (%(default)s)")
    parser.add_argument(
        "--keys",
        metavar="STORE",
        help="store of API keys from `scm key add`; required for another --host",
    )
    proxy_arguments(parser)
    parser.add_argument(
        "--demand", type=Path, metavar="TABLE", help="demand table: who drives from where to where"
    )
    parser.add_argument(
        "--radio",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="radio model instead of the map's, such as loss=0.3; see docs/radio.md",
    )
    parser.add_argument(
        "--without",
        action="extend",
        type=lambda text: list(filter(None, text.split(","))),
        default=[],
        metavar="PARTS",
        help="leave out parts, separated by commas, if the computer is too slow: "
        "eye, camera, record, observer, misbehaviour; see docs/performance.md",
    )
    _twin_arguments(parser)
    _join_arguments(parser)
    parser.add_argument("--ros2", action="store_true", help="let ROS 2 nodes see the city")


def _twin_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--twin", action="store_true", help="watch every car, and report since when one has changed"
    )
    parser.add_argument(
        "--twin-sends",
        choices=("agreed", "idle"),
        default="agreed",
        metavar="WHEN",
        help="with --twin: send cars to where they decide whose a change is: when an operator has "
        "`agreed`, or whenever they are `idle` (%(default)s)",
    )


def _join_arguments(parser: argparse.ArgumentParser) -> None:
    where = "CITY may be left out where the map has one neighbour; see docs/cities.md"
    parser.add_argument(
        "--join", action="append", default=[], metavar="[CITY=]ENDPOINT",
        help=f"join a neighbour of the map, which waits at this endpoint; {where}",
    )  # fmt: skip
    parser.add_argument(
        "--admit", action="append", default=[], metavar="[CITY=]ENDPOINT",
        help="wait at this endpoint for a neighbour of the map to join",
    )  # fmt: skip


def options_of(arguments: argparse.Namespace) -> "CityOptions":
    """Return the city that is asked for."""
    from scm.runtime.up import CityOptions

    settings = {**vars(arguments), "map_name": arguments.map}
    settings |= {
        name: tuple(settings[name])
        for name in ("radio", "cameras_of", "trust_proxy", "origin", "without", "join", "admit")
    }
    return CityOptions(**{field.name: settings[field.name] for field in fields(CityOptions)})


def _run(arguments: argparse.Namespace) -> int:
    from scm.api.based import check_base
    from scm.runtime.up import run_city

    check_base(arguments.base)
    return run_city(options_of(arguments))


COMMAND = Command(
    help="Start the whole city: router, world, signals, monitor, eye, dashboard, recorder, agents.",
    example="scm up driving_school",
    arguments=_arguments,
    run=_run,
)
