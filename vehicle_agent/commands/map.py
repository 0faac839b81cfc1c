"""`vehicle-agent map`: let a car make a map of the room about it."""

import argparse
import threading
from pathlib import Path

from scm.command import Command, agent_arguments, credentials_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", required=True, metavar="NAME", help="the car that maps")
    parser.add_argument(
        "--save", required=True, type=Path, metavar="PATH",
        help="of the map: PATH.yaml and PATH.pgm, as ROS's map_server and `scm up` read them",
    )  # fmt: skip
    parser.add_argument(
        "--watch", action="store_true",
        help="only watch while somebody else drives it, until Ctrl-C; default: drive round until "
        "nothing is left to see",
    )  # fmt: skip
    parser.add_argument("--car", default="nigel", help="its car file (%(default)s)")
    agent_arguments(parser, "of this agent, which holds the lease (map-VEHICLE)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.errors import RunError
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from scm.vehicles.car import load_car
    from vehicle_agent.autonomy.map_part import MapPart
    from vehicle_agent.autonomy.mapping import save_map
    from vehicle_agent.autonomy.parking import Report, prepare
    from vehicle_agent.leaving import Leaving

    vehicle = check_name(arguments.vehicle, "--vehicle")
    check_name(arguments.city, "--city")
    if not arguments.save.parent.is_dir():
        raise RunError(f"--save {arguments.save}: expected a folder that exists")
    credentials = credentials_of(arguments)
    name = arguments.name or f"map-{vehicle}"
    name = check_name(name if credentials is None else credentials.station, "--name")
    print("Preparing the planner (the first time this takes about a minute) ...", flush=True)
    prepare(load_car(arguments.car))
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()

    def show(report: Report) -> None:
        print(f"{vehicle}: {report.state}: {report.reason}", flush=True)
        if report.state in ("idle", "failed"):
            stop_requested.set()

    with ZenohBus(
        arguments.city, name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = MapPart(name, vehicle, arguments.car, drives=not arguments.watch, on_report=show)
        run(Leaving(part, stop_requested, done), bus, clock, done, on_tick=True)
    if part.exploration.report.state == "failed":
        raise RunError(part.exploration.report.reason)
    if part.exploration.grid is None:
        raise RunError(f"no LIDAR scan of {vehicle} came: no map was made")
    save_map(part.exploration.mapper.grid(), arguments.save)
    print(f"written to {arguments.save}.yaml: scm up {arguments.save}.yaml")
    return 0


COMMAND = Command(
    help="let a car make a map of the room about it",
    example="vehicle-agent map --vehicle n1 --save my_room",
    arguments=_arguments,
    run=_run,
)
