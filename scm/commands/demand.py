"""`scm demand`: cars that enter and leave by a demand table."""

import argparse
import sys
from pathlib import Path

from scm.command import Command, credentials_argument, run_part
from scm.errors import DemandError
from scm.v2x.router import DEFAULT_ENDPOINT


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("table", type=Path, metavar="TABLE", help=".toml, .csv or SUMO's .rou.xml")
    parser.add_argument(
        "map", nargs="?", default="driving_school", metavar="MAP", help="map name or file"
    )
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT", help="Zenoh router (%(default)s)"
    )
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument(
        "--time", metavar="HH:MM", help="time of day to start at; default: that of the first row"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.maps.load import load_map
    from scm.traffic.demand.part import DemandPart
    from scm.traffic.demand.table import load_demand, seconds_of_day

    begin_s = None if arguments.time is None else seconds_of_day(arguments.time, "--time")
    flows = load_demand(arguments.table, lambda line: print(line, file=sys.stderr, flush=True))
    city_map = load_map(arguments.map)
    try:
        part = DemandPart(city_map, flows, begin_s)
    except DemandError as error:
        raise DemandError(f"{arguments.table}: {error}") from error
    code = run_part(part, arguments)
    status = part.status
    print(
        f"{status.wanted} wanted, {status.entered} entered, {status.arrived} arrived, "
        f"{status.queued} waited at the end (at most {status.longest_queue}), "
        f"{status.refused} refused"
    )
    return code


COMMAND = Command(
    help="Let cars enter, drive and leave by a demand table.",
    example="scm demand rush.csv driving_school --connect tcp/127.0.0.1:7447",
    arguments=_arguments,
    run=_run,
)
