"""`scm play`: a written drive, open loop, with a car of this city or of a running one."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from scm.command import Command

if TYPE_CHECKING:
    from scm.fleet import Link


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("drive", type=Path, help="the drive's .yaml, as scm mismatch writes it")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", default=Path("played"), help="recording (%(default)s)"
    )
    parser.add_argument("--car", metavar="FILE", help="another car than the drive names")
    parser.add_argument(
        "--connect", metavar="ROUTER", help="of a running city; default: one of its own"
    )
    parser.add_argument(
        "--vehicle", metavar="NAME", help="a car of the running city that stands at the start"
    )


def _run(arguments: argparse.Namespace) -> int:
    from scm.fleet import LiveLink, LockstepLink
    from scm.lockstep import Lockstep
    from scm.maps.load import load_map
    from scm.play import play, read_drive, write_recording
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.world.part import WorldPart

    drive, rows = read_drive(arguments.drive)
    car = arguments.car or drive.car
    print(drive.say)
    if arguments.connect:
        with ZenohBus("city", "script", arguments.connect) as bus:
            played = play(LiveLink(bus), arguments.vehicle or "n1", rows)
    else:
        beside = arguments.drive.parent / drive.map
        city_map = load_map(beside if beside.is_file() else drive.map)
        with Lockstep([WorldPart(city_map)]) as lockstep:
            link = LockstepLink(lockstep)
            played = play(link, _spawned(link, car, drive.spawn), rows)
    write_recording(played, car, arguments.out)
    print(f"{len(played.poses)} poses of {rows[-1][0]:.0f} s recorded in {arguments.out}")
    return 0


def _spawned(link: "Link", car: str, spawn: str) -> str:
    from scm.errors import ScmError
    from scm.v2x.message import Refused
    from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest

    reply = link.ask(SpawnRequest(car=car, spawn=spawn))
    if isinstance(reply, SpawnReply):
        return reply.vehicle
    msg = f"{car}: {reply.detail if isinstance(reply, Refused) else type(reply).__name__}"
    raise ScmError(msg)


COMMAND = Command(
    help="Drive a written table of commands with one car, and record it for scm mismatch.",
    example="scm play found/next_drive.yaml --out again",
    arguments=_arguments,
    run=_run,
)
