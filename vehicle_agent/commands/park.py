"""`vehicle-agent park`: drive a car to a parking place by its own sensors."""

import argparse
import threading

from scm.command import Command, agent_arguments, credentials_of, place


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", required=True, metavar="NAME", help="the car to park")
    parser.add_argument(
        "--goal", type=place, default="", metavar="PLACE",
        help="a spawn place or bay of the map, any (bay), or X,Y,DEG (--goal=-0.7,0,90 if X is "
        "below 0); default: wait for requests to park, until Ctrl-C",
    )  # fmt: skip
    parser.add_argument(
        "--start", type=place, default="", metavar="PLACE",
        help="where the car roughly stands; default: it finds that out from its scans",
    )  # fmt: skip
    parser.add_argument(
        "--spawn", nargs="?", const="", type=place, metavar="PLACE",
        help="put the car onto the map first, there or at any free place",
    )  # fmt: skip
    parser.add_argument(
        "--eye", action="store_true", help="use the Eye's poses of the car, too, where it is seen"
    )
    parser.add_argument("--car", default="nigel", help="its car file (%(default)s)")
    agent_arguments(parser, "of this agent, which holds the lease (park-VEHICLE)")
    parser.add_argument("--seed", type=int, default=0, help="of the particles (%(default)s)")
    parser.add_argument(
        "--stack", default="own", metavar="NAME",
        help="planners and controller: own; mppi, with another local planner; or published: A* and "
        "the AutoDRIVE paper's gains (%(default)s)",
    )  # fmt: skip


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from scm.vehicles.car import load_car
    from vehicle_agent.autonomy.navigation import stack_named
    from vehicle_agent.autonomy.parking import Report, prepare
    from vehicle_agent.autonomy.part import ENDED, ParkPart, Wanted
    from vehicle_agent.leaving import Leaving

    vehicle = check_name(arguments.vehicle, "--vehicle")
    check_name(arguments.city, "--city")
    credentials = credentials_of(arguments)
    name = arguments.name or f"park-{vehicle}"
    name = check_name(name if credentials is None else credentials.station, "--name")
    wanted = Wanted(
        vehicle, arguments.goal, arguments.start, arguments.spawn, arguments.car, arguments.seed,
        use_eye=arguments.eye, stack=arguments.stack,
    )  # fmt: skip
    print("Preparing the planner (the first time this takes about a minute) ...", flush=True)
    prepare(load_car(arguments.car), stack_named(arguments.stack))
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()
    last = Report("localise")

    def show(report: Report) -> None:
        nonlocal last
        last = report
        why = f": {report.reason}" if report.reason else ""
        print(f"{vehicle}: {report.state}{why}", flush=True)
        if arguments.goal and report.state in ENDED:
            stop_requested.set()

    with ZenohBus(
        arguments.city, name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = ParkPart(name, wanted, bus.session, show)
        run(Leaving(part, stop_requested, done), bus, clock, done, on_tick=True)
    return 2 if last.state == "failed" else 0


COMMAND = Command(
    help="park a car by its own LIDAR, encoders and gyro",
    example="vehicle-agent park --vehicle n1 --spawn start --goal goal",
    arguments=_arguments,
    run=_run,
)
