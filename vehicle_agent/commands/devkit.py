"""`vehicle-agent devkit`: let an AutoDRIVE Devkit script drive cars of a city."""

import argparse
import gc
import threading
from typing import TYPE_CHECKING

from scm.command import Command, credentials_argument, credentials_of, place

if TYPE_CHECKING:
    from scm.v2x.credentials import Credentials

DEFAULT_PORT = 4567
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
MAX_RATE_HZ = 250.0


def _port(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) < 65536:
        msg = f"got {text!r}, expected 1 to 65535"
        raise argparse.ArgumentTypeError(msg)
    return int(text)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--car", dest="cars", action="append", required=True, metavar="NAME",
        help="a car of the city to drive; the first is the script's V1, the next V2",
    )  # fmt: skip
    parser.add_argument(
        "--script-port", type=_port, default=DEFAULT_PORT, help="port to serve (%(default)s)"
    )
    parser.add_argument("--script-host", default="127.0.0.1", help="address to bind (%(default)s)")
    parser.add_argument(
        "--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT",
        help="the city's router (%(default)s)",
    )  # fmt: skip
    credentials_argument(parser)
    parser.add_argument(
        "--name", help="of this bridge, which holds the leases: one a bridge (devkit-PORT)"
    )
    parser.add_argument("--city", default="city", help="name of the city on the bus (%(default)s)")
    parser.add_argument(
        "--light", dest="lights", type=int, action="append", default=[], metavar="ID",
        help="a light of the map; the first is TL1; default: all, in the map's order",
    )  # fmt: skip
    parser.add_argument(
        "--steering-sign", choices=("left", "right"), default="left",
        help="which way a steering of +1 turns (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--packet", choices=("0.1", "0.3", "newest"), default="0.3",
        help="for which simulator the script was written: 0.1 has no V1 in its keys, "
        "the newest compresses scans (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--cameras", nargs="*", choices=("front", "rear"), default=["front", "rear"],
        help="cameras to render; the others stay black (both)",
    )  # fmt: skip
    parser.add_argument(
        "--max-hz", type=float, default=MAX_RATE_HZ,
        help="maximum packets per second; 0: as fast as the script answers (%(default)s)",
    )  # fmt: skip
    brought = parser.add_mutually_exclusive_group()
    brought.add_argument(
        "--spawn", nargs="*", action="extend", type=place, metavar="PLACE",
        help="spawn the cars, at these places of the map, at X,Y,DEG (--spawn=-1,0,90 if X is "
        "below 0), or at free places, and remove them at the end",
    )  # fmt: skip
    brought.add_argument(
        "--cosim", action="store_true", help="the script places the cars itself, by PosX ... RotW"
    )
    parser.add_argument(
        "--car-file", default="nigel", help="of the cars that are spawned or placed (%(default)s)"
    )


def _check_is_the_car(cars: list[str], credentials: "Credentials") -> None:
    """Refuse a placed car without the rights of that vehicle: it joins and reports as one."""
    from scm.errors import AccessError

    if credentials.role != "vehicle" or cars != [credentials.station]:
        msg = f"--credentials: got {credentials.station!r}, a {credentials.role}; --cosim expects "
        msg += f"those of the one --car: scm fleet add {cars[0]} --role vehicle"
        raise AccessError(msg)


def _run(arguments: argparse.Namespace) -> int:
    from scm.clock import NS_PER_S, WallClock
    from scm.errors import RunError
    from scm.runtime.live import run, stop_on_signal
    from scm.v2x.bus_zenoh import ZenohBus
    from scm.v2x.key import check_name
    from vehicle_agent.devkit.bridge import DevkitPart, Wanted
    from vehicle_agent.devkit.engineio import ScriptSocket
    from vehicle_agent.leaving import Leaving

    for car in arguments.cars:
        check_name(car, "--car")
    if len(set(arguments.cars)) < len(arguments.cars) or not 0.0 <= arguments.max_hz < 1e6:
        msg = f"expected different cars and --max-hz from 0: got {arguments.cars}, "
        raise RunError(msg + f"{arguments.max_hz:g}")
    if arguments.packet == "0.1" and len(arguments.cars) > 1:
        raise RunError("--packet 0.1: its keys know one car only, got more than one --car")
    check_name(arguments.city, "--city")
    credentials = credentials_of(arguments)
    if arguments.cosim and credentials is not None:
        _check_is_the_car(arguments.cars, credentials)
    name = arguments.name or f"devkit-{arguments.script_port}"
    name = check_name(name if credentials is None else credentials.station, "--name")
    wanted = Wanted(
        cars=tuple(arguments.cars),
        lights=tuple(arguments.lights),
        sign=arguments.steering_sign,
        cameras=tuple(arguments.cameras),
        spawns=None if arguments.spawn is None else tuple(arguments.spawn),
        cosim=arguments.cosim,
        car=arguments.car_file,
        packet=arguments.packet,
    )
    gap_ns = round(NS_PER_S / arguments.max_hz) if arguments.max_hz else 0
    stop_requested, done, clock = stop_on_signal(), threading.Event(), WallClock()
    with ZenohBus(
        arguments.city, name, arguments.connect, clock=clock, credentials=credentials
    ) as bus:
        part = DevkitPart(name, wanted, bus.session)
        address = (arguments.script_host, arguments.script_port)
        script = ScriptSocket(address, part.packet, part.on_reply, clock, gap_ns)
        part.connect(script)
        script.start()
        try:
            run(Leaving(part, stop_requested, done), bus, clock, done)
        finally:
            script.stop()
    gc.freeze()  # freeing the compiler's objects one by one would take a quarter of a second
    return 0


COMMAND = Command(
    help="let an AutoDRIVE Devkit script drive cars of the city, until Ctrl-C",
    example="vehicle-agent devkit --script-port 4567 --car v1 --spawn",
    arguments=_arguments,
    run=_run,
)
