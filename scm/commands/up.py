"""`scm up`: the whole city, one process a part."""

import argparse
from pathlib import Path

from scm.command import Command


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument("--city", default="city", help="whose keys to use (%(default)s)")
    parser.add_argument(
        "--hosted", type=int, default=4, help="cars the world simulates (%(default)s)"
    )
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
    parser.add_argument("--seed", type=int, default=0, help="of all randomness (%(default)s)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.up import run_city

    return run_city(
        arguments.map,
        city=arguments.city,
        hosted=arguments.hosted,
        agents=arguments.agents,
        port=arguments.port,
        listen=arguments.listen,
        record_dir=arguments.record_dir,
        seed=arguments.seed,
    )


COMMAND = Command(
    help="Start the whole city: router, world, signals, monitor, eye, dashboard, recorder, agents.",
    example="scm up driving_school",
    arguments=_arguments,
    run=_run,
)
