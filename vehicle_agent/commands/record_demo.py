"""`vehicle-agent record-demo`: record what somebody drives, for a network to learn from."""

import argparse
import threading
from pathlib import Path

from scm.command import Command, agent_arguments, credentials_of


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--vehicle", required=True, metavar="NAME", help="the car that is driven")
    parser.add_argument(
        "--out", required=True, type=Path, metavar="DIR", help="folder of the demonstration"
    )
    parser.add_argument("--laps", type=int, default=5, help="how many (%(default)s)")
    parser.add_argument(
        "--dagger", action="store_true",
        help="record what the built-in driver would do, while a network drives",
    )  # fmt: skip
    agent_arguments(parser, "of this agent (demo-VEHICLE)")


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import WallClock
    from scm.errors import LearningError
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from vehicle_agent.cloning.recording import RecordDemoPart
    from vehicle_agent.leaving import Leaving

    vehicle = check_name(arguments.vehicle, "--vehicle")
    check_name(arguments.city, "--city")
    if arguments.laps < 1:
        raise LearningError(f"--laps: expected 1 or more, got {arguments.laps}")
    credentials = credentials_of(arguments)
    name = arguments.name or f"demo-{vehicle}"
    name = check_name(name if credentials is None else credentials.station, "--name")
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()

    def show(laps: int) -> None:
        print(f"{vehicle}: lap {laps} of {arguments.laps}", flush=True)
        if laps >= arguments.laps:
            stop_requested.set()

    part = RecordDemoPart(
        name, vehicle, arguments.out, arguments.laps, show, dagger=arguments.dagger
    )
    print(f"Recording {vehicle} until it has driven {arguments.laps} laps, or Ctrl-C", flush=True)
    with ZenohBus(
        arguments.city, name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        run(Leaving(part, stop_requested, done), bus, clock, done, on_tick=True)
    if not part.samples:
        raise LearningError(f"no frame of {vehicle}'s front camera came: nothing was recorded")
    print(f"{len(part.samples)} frames in {arguments.out}: vehicle-agent train {arguments.out}")
    return 0


COMMAND = Command(
    help="record the front camera and the commands of a car that somebody drives",
    example="vehicle-agent record-demo --vehicle n1 --laps 5 --out demos/mine",
    arguments=_arguments,
    run=_run,
)
