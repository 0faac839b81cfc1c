"""`scm play`: a written drive, open loop, with a car of this city or of a running one."""

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of
from scm.errors import RunError

if TYPE_CHECKING:
    from scm.recorder.play_monitor import PlayMonitor

NAME = "played"


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "drive", type=Path, metavar="DRIVE", help="the drive's .yaml, as scm mismatch writes it"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", default=Path("played"), help="recording (%(default)s)"
    )
    parser.add_argument("--car", metavar="FILE", help="another car than the drive names")
    parser.add_argument(
        "--connect", metavar="ROUTER", help="router of a running city; default: a city of its own"
    )
    credentials_argument(parser)
    parser.add_argument("--city", default="city", help="name of the running city (%(default)s)")
    parser.add_argument(
        "--vehicle", metavar="NAME", help="a car of the running city that stands at the start"
    )
    parser.add_argument(
        "--floor",
        type=float,
        nargs=4,
        metavar=("X0", "X1", "Y0", "Y1"),
        help="floor of the running city [m]: bring the car to rest, refuse a drive that does not "
        "fit from there, end it at the floor's edge, at a collision, or on Ctrl-C",
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.fleet import LiveLink, LockstepLink
    from scm.maps.load import load_map
    from scm.recorder.play import left_out, play, read_drive, write_recording
    from scm.runtime.lockstep import Lockstep
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.world.part import WorldPart

    if arguments.vehicle and not arguments.connect:
        msg = f"--vehicle {arguments.vehicle}: only a running city has such a car: --connect ROUTER"
        raise RunError(msg)
    drive, rows = read_drive(arguments.drive)
    beside = arguments.drive.parent / drive.car
    car = arguments.car or (str(beside) if beside.is_file() else drive.car)
    print(drive.say)
    if arguments.connect:
        with ZenohBus(
            arguments.city, "script", arguments.connect, credentials=credentials_of(arguments)
        ) as bus:
            monitor = _monitor(arguments, car) if arguments.floor else None
            played = play(LiveLink(bus), arguments.vehicle or "n1", rows, monitor)
    else:
        floor = arguments.drive.parent / drive.map
        city_map = load_map(floor if floor.is_file() else drive.map)
        part = WorldPart(city_map)
        with Lockstep([part]) as lockstep:
            lockstep.run_for(0.1)
            start = drive.spawn or city_map.spawns[0].name
            world = part.world  # not by request: only who is in this process may name any car file
            world.host(NAME, car, world.roads.spawn_pose(start), lockstep.now_ns)
            played = play(LockstepLink(lockstep), NAME, rows)
    recording = write_recording(played, _named(car, arguments.out), arguments.out)
    poses = len(recording.channel("pose.x").t)
    print(f"{poses} poses of {rows[-1][0]:.0f} s recorded in {arguments.out}")
    for sentence in left_out(played, recording):
        print(sentence)
    return 0


def _monitor(arguments: argparse.Namespace, car: str) -> "PlayMonitor":
    """Return what to look for on a city's floor, for a car of that size."""
    from scm.recorder.play import read_way
    from scm.recorder.play_monitor import PlayMonitor
    from scm.runtime.live import stop_on_signal
    from scm.vehicles.car import load_car

    x0, x1, y0, y1 = arguments.floor
    own = load_car(car)
    known = own.has("body.footprint_x_m")
    ends = own.vector("body.footprint_x_m") if known else (own.value("body.wheelbase_m") * 1.5,)
    return PlayMonitor(
        floor=((x0, x1), (y0, y1)),
        margin_m=max(abs(end) for end in ends),
        way=read_way(arguments.drive),
        stop_requested=stop_on_signal(),
    )


def _named(car: str, folder: Path) -> str:
    """Return a car as a recording in `folder` names it: a file by the way to it from there."""
    return os.path.relpath(car, folder) if Path(car).is_file() else car


COMMAND = Command(
    help="Drive a table of commands with one car, and record it for scm mismatch.",
    example="scm play found/next_drive/next_drive.yaml --out again",
    arguments=_arguments,
    run=_run,
)
